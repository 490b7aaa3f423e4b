//! Means over the scenes of every plan, with the backends side by side.

use super::{Named, Table, ours::all_plans};
use crate::{
    record::Measurement,
    report::{
        format::{mebibytes, number, or},
        results::{Part, Results, Row},
    },
    statistics::Spread,
};

/// A row for each plan: printed and measured speed-ups over BP, times, memory and errors.
pub(in crate::report) fn table(results: &Results<'_>) -> Table {
    let backends: Vec<&str> = results.devices().into_iter().map(|(backend, _)| backend).collect();
    let each = |what: &str| backends.iter().map(|backend| format!("{what} {}", results.label(backend))).collect();
    let columns: Vec<String> = [
        vec!["plan".to_owned(), "speed-up, %: printed".to_owned()],
        each("speed-up, %:"),
        each("ms:"),
        ["memory, MiB", "wrong by > 1 px, non-occluded, %", "all, %", "RMSE, px"].map(str::to_owned).into(),
    ]
    .concat();
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    Table::new("", "", &columns).rows(all_plans(results).iter().map(|plan| row(results, &backends, plan)))
}

fn row(results: &Results<'_>, backends: &[&str], plan: &Named) -> Vec<String> {
    let of_each = |value: &dyn Fn(&Row<'_>) -> Option<f64>, decimals| -> Vec<String> {
        let cell = |&backend: &&str| {
            let none = results.missing_mean(backend, plan.plan, "-");
            or(results.mean(backend, value).map(|mean| number(mean, decimals)), none)
        };
        backends.iter().map(cell).collect()
    };
    let percent = |row: &Row<'_>| {
        Some((row.speed_up(plan.plan, Part::Total)?.median - 1.0) * 100.0).filter(|_| plan.plan != "bp")
    };
    let printed = |row: &Row<'_>| results.thesis.speed_up_percent(plan.printed?, row.index);
    let printed = backends.first().and_then(|backend| results.mean(backend, printed));
    let means = |of: fn(&Measurement) -> f64| {
        backends.iter().filter_map(move |backend| results.mean(backend, |row| row.measured(plan.plan).map(of)))
    };
    let memory = Spread::of(means(|measured| mebibytes(measured.allocated_bytes)));
    // All backends give the same labels, so the first one with numbers is enough.
    let error = |of| or(means(of).next().map(|mean| number(mean, 1)), "-");
    let [bad, all, rmse] = [
        error(|measured| measured.visible.bad[1]),
        error(|measured| measured.all.bad[1]),
        error(|measured| measured.all.rmse),
    ];
    [
        vec![plan.title.to_owned(), or(printed.map(|mean| number(mean, 1)), "-")],
        of_each(&percent, 0),
        of_each(&|row| Some(row.time(plan.plan, Part::Total)?.median), 1),
        vec![or(memory.map(range), "-"), bad, all, rmse],
    ]
    .concat()
}

/// The least and the largest number, or a single number if both look the same.
fn range(spread: Spread) -> String {
    let [low, high] = [spread.low, spread.high].map(|value| number(value, 0));
    if low == high { low } else { format!("{low} to {high}") }
}
