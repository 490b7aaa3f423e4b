//! A record as CSV: a row for every sample.

use serde::Serialize;

use crate::{
    escape::printable,
    failure::Failure,
    record::{Cell, Clock, Measurement, Record, Sample},
};

/// A row; its fields are the columns.
#[derive(Serialize)]
struct Row<'a> {
    scene: &'a str,
    plan: &'a str,
    backend: &'a str,
    device: &'a str,
    software_rasteriser: Option<bool>,
    round: u32,
    prepare_ms: Option<f64>,
    total_ms: f64,
    /// The clock of the stages: the device's, if it has one.
    stages_clock: &'static str,
    match_cost_ms: Option<f64>,
    coarsen_ms: Option<f64>,
    refine_ms: Option<f64>,
    update_messages_ms: Option<f64>,
    select_labels_ms: Option<f64>,
    energy: u64,
    visible_bad_1px_percent: f64,
    visible_rmse_px: f64,
    all_bad_1px_percent: f64,
    all_rmse_px: f64,
    labels_sha256: &'a str,
}

/// The table with its heading.
pub(super) fn csv(record: &Record) -> Result<String, Failure> {
    let failed = |error: &dyn std::fmt::Display| Failure::other(format!("cannot write CSV: {error}"));
    let mut writer = csv::Writer::from_writer(Vec::new());
    for (cell, measured) in record.cells.iter().filter_map(|cell| Some((cell, cell.measured()?))) {
        let device = cell.device.as_ref().map_or("", |device| &device.name);
        let shown = [&cell.scene, &cell.plan, &cell.backend, device, &measured.labels_sha256].map(harmless);
        for sample in &measured.samples {
            writer.serialize(row(cell, measured, sample, shown.each_ref())).map_err(|error| failed(&error))?;
        }
    }
    let bytes = writer.into_inner().map_err(|error| failed(&error))?;
    String::from_utf8(bytes).map_err(|error| failed(&error))
}

fn row<'a>(cell: &Cell, measured: &Measurement, sample: &Sample, shown: [&'a String; 5]) -> Row<'a> {
    let [scene, plan, backend, device, labels_sha256] = shown;
    let clocked = sample.clocks.last();
    let stages = clocked.map(|clocked| clocked.stages);
    Row {
        scene,
        plan,
        backend,
        device,
        software_rasteriser: cell.device.as_ref().map(|device| device.software_rasteriser),
        round: sample.round,
        prepare_ms: sample.prepare_ms,
        total_ms: sample.total_ms,
        stages_clock: match clocked.map(|clocked| clocked.clock) {
            Some(Clock::Wall) => "wall",
            Some(Clock::Device) => "device",
            None => "",
        },
        match_cost_ms: stages.map(|stages| stages.match_cost_ms),
        coarsen_ms: stages.map(|stages| stages.coarsen_ms),
        refine_ms: stages.map(|stages| stages.refine_ms),
        update_messages_ms: stages.map(|stages| stages.update_messages_ms),
        select_labels_ms: stages.map(|stages| stages.select_labels_ms),
        energy: measured.energy.total,
        visible_bad_1px_percent: measured.visible.bad[1],
        visible_rmse_px: measured.visible.rmse,
        all_bad_1px_percent: measured.all.bad[1],
        all_rmse_px: measured.all.rmse,
        labels_sha256,
    }
}

/// Escapes text that a spreadsheet might run as a formula.
fn harmless(text: &str) -> String {
    let text = printable(text);
    let formula = text.trim_start().starts_with(['=', '+', '-', '@']);
    if formula { format!("'{text}") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_become_text() {
        assert_eq!(harmless("=HYPERLINK(\"a\")"), "'=HYPERLINK(\"a\")");
        assert_eq!([harmless(" @SUM(1)"), harmless("a\r\nb")], ["' @SUM(1)", "a\u{fffd}\u{fffd}b"]);
        assert_eq!(harmless("CPU, AVX-512"), "CPU, AVX-512");
    }
}
