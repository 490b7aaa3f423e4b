//! The summary of the report: results, experiment, devices, why printed and measured numbers differ, and the plans.

use super::{
    Report,
    format::number,
    results::{Part, Results},
    tables::{BP, Named, Table, means, ours::all_plans, thesis_plans},
};
use crate::record::{Device, Machine, Program, Record};

/// The thesis. CITATION.cff names it too.
const AUTHOR: &str = "Doan Van Tuan";
const TITLE: &str = "Nghiên cứu giải pháp nâng cao tốc độ xử lý tín hiệu trong hệ thống thị giác nổi";
const ENGLISH: &str = "Research on solutions to speed up signal processing in stereo vision systems";
const INSTITUTION: &str = "Academy of Military Science and Technology, Hanoi";
const YEAR: &str = "2019";

const WHY: [&str; 3] = [
    "The thesis measured CUDA programs on a GeForce GTX 750 Ti, so compare speed-ups, not milliseconds.",
    "A model of its printed times says that about 40 % of BP's time was not message passing; here that share is small, \
     so CFBP and CFCSBP, which save message passing, can be much faster than BP.",
    "The thesis compares the four parts of CTBP and CTCSBP, run at once, with BP. Where all workers share the whole image in \
     every plan, BP's included, a cut gains nothing but a smaller working set. The rows of parts side by side compare them \
     with BP on one worker.",
];

/// A part of the summary.
pub(super) struct Passage {
    pub(super) title: &'static str,
    pub(super) lines: Vec<String>,
    pub(super) table: Option<Table>,
}

/// The summary, in order.
pub(super) fn passages(report: &Report<'_>) -> Vec<Passage> {
    let results = &report.results;
    let thesis =
        format!("The experiment follows this PhD thesis: {AUTHOR}, \"{TITLE}\" ({ENGLISH}), {INSTITUTION}, {YEAR}.");
    let abbreviations = "In every chart a plan keeps its name and the shape of its marker. BP is belief propagation.";
    vec![
        Passage { title: "Results", lines: outcomes(results), table: Some(means::table(results)) },
        Passage { title: "The experiment", lines: [vec![thesis], what_ran(results)].concat(), table: None },
        Passage { title: "Machine and devices", lines: where_it_ran(results), table: None },
        Passage { title: "Why printed and measured numbers differ", lines: WHY.map(str::to_owned).into(), table: None },
        Passage { title: "The plans", lines: vec![abbreviations.to_owned()], table: Some(names(results)) },
    ]
}

/// The heading of the report.
pub(super) fn title(report: &Report<'_>) -> String {
    let quick = if report.results.record.run.quick { ", a quick run" } else { "" };
    format!("Belief propagation for stereo matching, on {}{quick}", report.results.record.machine.cpu)
}

/// The result of a run in one line: the thesis's fastest algorithm compared with BP, on the fastest backend. `None` if
/// no algorithm has numbers for every scene.
#[must_use]
pub fn headline(record: &Record) -> Option<String> {
    outcome(&Results::new(record).ok()?, &thesis_plans())
}

fn outcomes(results: &Results<'_>) -> Vec<String> {
    let ours: Vec<Named> = all_plans(results).into_iter().filter(|plan| plan.printed.is_none()).collect();
    let lines: Vec<String> =
        [outcome(results, &thesis_plans()), outcome(results, &ours)].into_iter().flatten().collect();
    if lines.is_empty() {
        return vec!["No plan has numbers for every scene.".to_owned()];
    }
    let table = "The table shows means over the scenes. Its speed-ups are in percent, as the thesis counts them: 100 % is \
                 twice as fast as BP. Times go from images to labels.";
    lines.into_iter().map(|line| line + ".").chain([table.to_owned()]).collect()
}

/// Compares the fastest of some plans with BP on its backend. Software rasterisers count only if nothing else was used.
fn outcome(results: &Results<'_>, plans: &[Named]) -> Option<String> {
    let devices = results.devices();
    let only_software = devices.iter().all(|(_, device)| device.software_rasteriser);
    let backends = || devices.iter().filter(|(_, device)| only_software || !device.software_rasteriser);
    let ms = |backend: &str, plan: &Named| results.mean(backend, |row| Some(row.time(plan.plan, Part::Total)?.median));
    let others = plans.iter().filter(|plan| plan.plan != BP.plan);
    let timed =
        others.flat_map(|plan| backends().filter_map(move |&(backend, _)| Some((ms(backend, plan)?, plan, backend))));
    let (_, plan, backend) = timed.min_by(|(a, ..), (b, ..)| a.total_cmp(b))?;
    let ratio = results.mean(backend, |row| Some(row.speed_up(plan.plan, Part::Total)?.median))?;
    let printed = results.mean(backend, |row| results.thesis.speed_up_percent(plan.printed?, row.index));
    // A quick run uses smaller images than the thesis.
    let printed = printed.filter(|_| !results.record.run.quick).map(|percent| 1.0 + percent / 100.0);
    let printed = printed.map_or(String::new(), |ratio| format!(" (printed: {} times)", number(ratio, 1)));
    let bad = |plan: &Named| results.mean(backend, |row| Some(row.measured(plan.plan)?.visible.bad[1]));
    Some(format!(
        "{}: {} times as fast as BP on {}{printed}, {} % bad pixels non-occluded (BP: {} %)",
        plan.title,
        number(ratio, 1),
        results.label(backend),
        number(bad(plan)?, 1),
        number(bad(&BP)?, 1)
    ))
}

fn what_ran(results: &Results<'_>) -> Vec<String> {
    let (record, run) = (results.record, &results.record.run);
    let mut lines = vec![
        format!("Images: {}; L = {} labels, k = {} loops of BP.", results.data(), run.labels, run.k),
        program_fact(&record.program),
        format!("Started {}, last written {}.", record.started, record.updated),
        "Printed numbers come from the thesis. All others were measured in this run. Totals use the wall clock; message \
         passing uses the device's own clock if it has one. Times are noisy: compare ratios, and look at the ranges."
            .to_owned(),
        "A bad pixel is wrong by more than 1 px. Non-occluded pixels are those that both cameras see.".to_owned(),
    ];
    if run.quick {
        let k = run.k;
        lines.push(format!(
            "This is a quick run with small images and k = {k} instead of k = L, not the thesis's experiment."
        ));
    }
    if !record.complete {
        lines.push("The run is not complete. Missing numbers are marked \"not run\".".to_owned());
    }
    lines
}

fn where_it_ran(results: &Results<'_>) -> Vec<String> {
    let devices = results.devices().into_iter().map(|(backend, device)| device_fact(backend, device));
    [machine_fact(&results.record.machine)].into_iter().chain(devices).chain(results.unavailable()).collect()
}

fn names(results: &Results<'_>) -> Table {
    let row = |plan: Named| vec![plan.title.to_owned(), plan.meaning.to_owned()];
    Table::new("", "", &["plan", "meaning"]).rows(all_plans(results).into_iter().map(row))
}

/// The machine in a sentence.
pub fn machine_fact(machine: &Machine) -> String {
    format!("Machine: {}, {}, {}.", machine.cpu, counted(machine.cores, "core"), machine.system)
}

/// The program in a sentence.
pub fn program_fact(program: &Program) -> String {
    let changes = if program.clean_tree { "" } else { " with uncommitted changes" };
    let Program { version, commit, rustc, flags, .. } = program;
    format!("Program: bp {version}, commit {commit}{changes}, {rustc}, {flags}.")
}

/// A device in a sentence.
pub fn device_fact(backend: &str, device: &Device) -> String {
    let through =
        [&device.api, &device.driver].into_iter().flatten().map(|name| format!(", {name}")).collect::<String>();
    let software = " (a software rasteriser: it runs on the CPU, so its times are not a GPU's)";
    let software = if device.software_rasteriser { software } else { "" };
    let workers = if device.api.is_some() { String::new() } else { format!(", {}", counted(device.workers, "worker")) };
    format!("Backend {backend}: {}{through}{workers}{software}.", device.name)
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thesis_is_named_as_in_the_citation_file() {
        let citation = include_str!("../../../../CITATION.cff");
        let (family, given) = AUTHOR.split_once(' ').unwrap();
        for part in
            [TITLE, ENGLISH, INSTITUTION, &format!("\"{family}\", given-names: \"{given}\""), &format!("year: {YEAR}")]
        {
            assert!(citation.contains(part), "{part}");
        }
    }

    #[test]
    fn the_headline_of_a_recorded_run_names_plan_backend_and_both_ratios() {
        let run = "../../results/2026-11-21-amd-epyc-2-cores-every-backend-middlebury2006";
        let record = crate::record::load(std::path::Path::new(run)).unwrap();
        assert_eq!(
            headline(&record).unwrap(),
            "CFCSBP, Z''=2: 8.3 times as fast as BP on rayon (printed: 2.3 times), \
             23.1 % bad pixels non-occluded (BP: 23.8 %)"
        );
        assert_eq!(headline(&Record { cells: Vec::new(), ..record }), None);
    }

    #[test]
    fn one_has_no_plural() {
        assert_eq!([counted(1, "core"), counted(2, "core")], ["1 core", "2 cores"]);
    }
}
