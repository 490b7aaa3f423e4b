//! Computer and images.

use super::Table;
use crate::report::{
    format::{mebibytes, number, whole},
    results::Results,
};

/// Table 3.1.
pub(super) fn computer(results: &Results<'_>) -> Table {
    let (machine, program) = (&results.record.machine, &results.record.program);
    let gpus = gpus(results);
    let ours = |what: &str| match what {
        "Processor" => format!("{}, {} cores usable", machine.cpu, machine.cores),
        "Memory" => format!("{} MiB", number(mebibytes(machine.memory_bytes), 0)),
        "GPU" => gpus.clone(),
        "System" => machine.system.clone(),
        _ => format!("bp {}, {}, {}", program.version, program.rustc, program.flags),
    };
    let rows = results.thesis.computer.iter();
    Table::new("3.1", "The computer", &["", "thesis (printed)", "ours"])
        .rows(rows.map(|(what, printed)| vec![what.clone(), printed.clone(), ours(what)]))
}

/// The GPUs that were used, and the software rasterisers, marked as such.
fn gpus(results: &Results<'_>) -> String {
    let mut names: Vec<String> = Vec::new();
    for (_, device) in results.devices().into_iter().filter(|(_, device)| device.api.is_some()) {
        let software = if device.software_rasteriser { " (a software rasteriser, not a GPU)" } else { "" };
        let name = format!("{}{software}", device.name);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    if names.is_empty() { "none used".to_owned() } else { names.join(", ") }
}

/// Table 3.2.
pub(super) fn images(results: &Results<'_>) -> Table {
    let columns: Vec<_> = "# | thesis: name | size | \"disparity true\" | ours: scene | \
                           size | labels L | \
                           largest true disparity, px | pixels of known truth | non-occluded pixels"
        .split(" | ")
        .collect();
    let rows = results.scenes().zip(&results.thesis.images).map(|((index, scene), printed)| {
        vec![
            (index + 1).to_string(),
            printed.name.clone(),
            format!("{}x{}", printed.width, printed.height),
            printed.disparity_true.to_string(),
            scene.name.clone(),
            format!("{}x{}", scene.width, scene.height),
            results.record.run.labels.to_string(),
            number(scene.largest_disparity.into(), 1),
            whole(scene.known),
            whole(scene.visible),
        ]
    });
    let note = "\"Disparity true\" is the data set's horizontal crop in full-size pixels, not a number of labels. \
                Non-occluded pixels are those of known truth that both cameras see.";
    Table::new("3.2", "The images", &columns).note(note).rows(rows)
}
