//! The result of a gate, as Markdown.

use std::fmt::Write as _;

use super::{
    judge::{JudgedFact, Judgement, SpeedUp, Standard},
    verdict::Ratio,
};
use crate::report::{lines, machine_fact, program_fact};

/// How to read the table.
const READING: &str = "A speed-up says how many times as long the other side takes; its interval is of the median over \
                       the rounds, 95 %. One is worse where the whole interval lies below what the baseline tolerates, \
                       in two measurements.";

/// The whole page.
pub fn page(judgement: &Judgement) -> String {
    let kind = if judgement.quick { ", quick" } else { "" };
    let mut text = format!("# Gate{kind}, on {}\n\n", judgement.machine.cpu);
    about(judgement).iter().for_each(|line| _ = writeln!(text, "* {line}"));
    let columns = ["speed-up", "now", "interval", "baseline", "tolerated from", "verdict"];
    let _ = writeln!(text, "\n{READING}\n\n{}", table(&columns, judgement.speed_ups.iter().map(speed_up).collect()));
    let _ = writeln!(text, "{}.\n", judgement.summary());
    let facts = &judgement.facts;
    let changed: Vec<_> = facts.iter().filter(|fact| fact.has_changed()).collect();
    let known = facts.iter().filter(|fact| fact.baseline.is_some()).count();
    let _ = writeln!(
        text,
        "Work, energy, accuracy and memory do not vary: {} numbers, {} as in the baseline, {} changed, {} without one.",
        facts.len(),
        known - changed.len(),
        changed.len(),
        facts.len() - known
    );
    if !changed.is_empty() {
        let rows = changed.into_iter().map(fact).collect();
        let _ = write!(text, "\n{}", table(&["number", "now", "baseline"], rows));
    }
    judgement.missing.iter().for_each(|name| _ = writeln!(text, "* Not measured any more: {name}."));
    text
}

/// What a reader must know before the numbers.
fn about(judgement: &Judgement) -> Vec<String> {
    let mut about = vec![machine_fact(&judgement.machine), program_fact(&judgement.program)];
    about.extend(judgement.devices.iter().map(|(runner, device)| format!("{runner}: {device}.")));
    about.extend(judgement.unavailable.iter().map(|why| format!("Not measured: {why}.")));
    about.push(format!("Rounds: {}.", judgement.rounds));
    if !judgement.has_baseline {
        about.push(format!(
            "There is no baseline for this kind of machine ({}): speed-ups are held against the least on other kinds. \
             `bp gate --update` writes one.",
            judgement.baseline
        ));
    }
    about.extend(judgement.disturbance.iter().map(|what| format!("Disturbed: {what}.")));
    about
}

fn speed_up(speed_up: &SpeedUp) -> Vec<String> {
    let SpeedUp { name, first, second, baseline, verdict } = speed_up;
    let Ratio { median, low, high } = second.as_ref().unwrap_or(first);
    let again = if second.is_some() { " (measured again)" } else { "" };
    let figure = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), figures);
    vec![
        name.clone(),
        figures(*median),
        format!("{} to {}{again}", figures(*low), figures(*high)),
        figure(baseline.map(|standard| standard.value)),
        figure(baseline.map(Standard::floor)),
        verdict.name().to_owned(),
    ]
}

fn fact(fact: &JudgedFact) -> Vec<String> {
    let JudgedFact { name, value, baseline } = fact;
    vec![name.clone(), value.clone(), baseline.clone().unwrap_or_default()]
}

/// Formats a number with three significant digits.
fn figures(value: f64) -> String {
    let decimals = if value < 10.0 { 2 } else { usize::from(value < 100.0) };
    format!("{value:.decimals$}")
}

pub(super) fn table(columns: &[&str], rows: Vec<Vec<String>>) -> String {
    let columns: Vec<_> = columns.iter().map(|&column| column.to_owned()).collect();
    lines(&columns, &rows)
}
