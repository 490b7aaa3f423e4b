//! Algorithms against BP, and all of them together.

use super::{
    BP, Named, Table, family,
    measured::{NOT_PRINTED, mib, table},
    thesis_plans,
};
use crate::report::{
    format::{Spread, mebibytes, number, or, whole},
    results::{Part, Results, Row},
};

/// `(T_BP / T - 1) * 100`, the thesis's speed-up in percent.
fn percent(ratio: f64) -> String {
    number((ratio - 1.0) * 100.0, 2)
}

fn speed_up(row: &Row<'_>, plan: &str, part: Part) -> String {
    let text = |ratio: Spread| match ratio.count {
        0..=2 => percent(ratio.median),
        _ => format!("{} ({} to {})", percent(ratio.median), percent(ratio.low), percent(ratio.high)),
    };
    or(row.speed_up(plan, part).map(text), row.missing(plan))
}

fn bad(row: &Row<'_>, plan: &str) -> String {
    or(row.measured(plan).map(|measured| number(measured.all.bad[1], 2)), row.missing(plan))
}

fn time(row: &Row<'_>, plan: &str, part: Part) -> String {
    or(row.time(plan, part).map(|time| time.to_string()), row.missing(plan))
}

/// Tables 3.18, 3.21, 3.24, 3.26.
pub(super) fn speed(results: &Results<'_>, number: &str, plans: &[Named]) -> Table {
    let columns = "printed: BP, ms | plan, ms | speed-up, % | ours: updates, BP / plan | message passing: BP, ms | \
                   plan, ms | speed-up, % | total: BP, ms | plan, ms | speed-up, % | B>1 all: BP, % | plan, %";
    let has_parts = plans.iter().any(Named::is_cut);
    let columns = if has_parts { format!("{columns} | workers | efficiency") } else { columns.to_owned() };
    let title = format!("{} against BP: processing speed", family(plans));
    let note = "Speed-up is (T_BP / T - 1) * 100. Both ran on the same device. A range covers the rounds in which the two \
                took turns.";
    let table = table(results, number, title, plans, &columns, |row, plan| {
        let [bp_ms, _] = printed(results, row, &BP);
        let fewer = fewer_updates(row, plan).map(|ratio| format!("{ratio:.2}"));
        let mut cells = vec![bp_ms];
        cells.extend(printed(results, row, plan));
        cells.push(or(fewer, ""));
        for part in [Part::MessagePassing, Part::Total] {
            let base = or(row.base_time(plan.plan, part).map(|time| time.to_string()), row.missing("bp"));
            cells.extend([base, time(row, plan.plan, part), speed_up(row, plan.plan, part)]);
        }
        cells.extend([bad(row, "bp"), bad(row, plan.plan)]);
        cells.extend(efficiency(row, plan).into_iter().filter(|_| has_parts));
        cells
    });
    table.note(format!("{note}{}", if has_parts { SIDE_BY_SIDE } else { "" }))
}

/// What a plan with parts side by side is compared with.
const SIDE_BY_SIDE: &str = " Parts side by side are compared with BP on one worker. Their efficiency is the ratio of the \
                            total times, divided by the ratio of updates and by the number of workers.";

/// The workers of a plan with parts side by side, and how well it uses them.
fn efficiency(row: &Row<'_>, plan: &Named) -> [String; 2] {
    let workers = row.workers(plan.plan);
    // A GPU has no workers that could be counted.
    let ratio = row.speed_up(plan.plan, Part::Total).filter(|_| row.is_processor());
    let ratio = ratio.zip(fewer_updates(row, plan)).map(|(ratio, fewer)| ratio.median / fewer);
    let ratio = workers.zip(ratio).map(|(workers, ratio)| ratio / workers as f64);
    [or(workers.map(|workers| workers.to_string()), "-"), or(ratio.map(|ratio| number(ratio, 2)), "-")]
}

/// The printed time of a plan and its speed-up over BP.
fn printed(results: &Results<'_>, row: &Row<'_>, plan: &Named) -> [String; 2] {
    let name = plan.printed.unwrap_or("");
    let ms = results.thesis.time_ms(name, row.index).map(|ms| format!("{ms}"));
    let percent = results.thesis.speed_up_percent(name, row.index).map(|percent| format!("{percent:.2}"));
    [or(ms, "not printed"), or(percent, if plan.plan == "bp" { "" } else { "not printed" })]
}

/// Predicted message entries of BP over those of a plan.
fn fewer_updates(row: &Row<'_>, plan: &Named) -> Option<f64> {
    Some(row.cell("bp")?.settings.message_updates as f64 / row.cell(plan.plan)?.settings.message_updates as f64)
}

/// Tables 3.19, 3.22, 3.25a, 3.27.
pub(super) fn memory(results: &Results<'_>, number_of: &str, plans: &[Named]) -> Table {
    let columns = "printed | ours: BP, MiB | plan, MiB | plan / BP";
    let ours = if number_of == "3.25a" { " (not in the thesis)" } else { "" };
    let has_parts = plans.iter().any(Named::is_cut);
    let parts =
        if has_parts { " Parts in turn need the memory of one; otherwise all four are held at once." } else { "" };
    let title = format!("{} against BP: required memory{ours}", family(plans));
    table(results, number_of, title, plans, columns, |row, plan| {
        let bytes = |plan: &str| row.measured(plan).map(|measured| measured.allocated_bytes);
        let ratio = bytes("bp").zip(bytes(plan.plan)).map(|(bp, other)| number(other as f64 / bp as f64, 3));
        let [bp, own] = ["bp", plan.plan].map(|plan| or(bytes(plan).map(mib), row.missing(plan)));
        vec![NOT_PRINTED.to_owned(), bp, own, or(ratio, "")]
    })
    .note(format!("Allocated bytes, as counted.{parts}"))
}

/// Tables 3.20, 3.23, 3.25, 3.28.
pub(super) fn reliability(results: &Results<'_>, number_of: &str, plans: &[Named]) -> Table {
    let columns =
        "printed | ours: R all, BP | plan | B>1 all, BP | plan | B>1 non-occluded, BP | plan | energy, BP | plan";
    let title = format!("{} against BP: reliability", family(plans));
    let note = "R is in pixels, B in percent. After the same number of loops, plain BP's energy is much higher under \
                the schedule sync than under checkerboard.";
    table(results, number_of, title, plans, columns, |row, plan| {
        let mut cells = vec![NOT_PRINTED.to_owned()];
        let Some((bp, other)) = row.measured("bp").zip(row.measured(plan.plan)) else {
            cells.push(row.missing(plan.plan).to_owned());
            return cells;
        };
        cells.extend([bp, other].map(|measured| number(measured.all.rmse, 2)));
        cells.extend([bp, other].map(|measured| number(measured.all.bad[1], 2)));
        cells.extend([bp, other].map(|measured| number(measured.visible.bad[1], 2)));
        cells.extend([bp, other].map(|measured| whole(measured.energy.total)));
        cells
    })
    .note(note)
}

/// Table 3.29.
pub(super) fn all_speeds(results: &Results<'_>) -> Table {
    let columns =
        "printed, ms | speed-up, % | ours: message passing, ms | speed-up, % | total, ms | speed-up, % | B>1 all, %";
    table(results, "3.29", "All algorithms: processing speed".to_owned(), &thesis_plans(), columns, |row, plan| {
        let mut cells = Vec::from(printed(results, row, plan));
        for part in [Part::MessagePassing, Part::Total] {
            let ours = if plan.plan == "bp" { String::new() } else { speed_up(row, plan.plan, part) };
            cells.extend([time(row, plan.plan, part), ours]);
        }
        cells.push(bad(row, plan.plan));
        cells
    })
}

/// Table 3.30, ours.
pub(super) fn all_memory(results: &Results<'_>) -> Table {
    let plans = thesis_plans();
    let columns: Vec<_> = ["#", "scene", "backend"].into_iter().chain(plans.iter().map(|plan| plan.title)).collect();
    let rows = results.rows().map(|row| {
        let bytes = |plan: &Named| row.measured(plan.plan).map(|measured| mebibytes(measured.allocated_bytes));
        let cells = plans.iter().map(|plan| or(bytes(plan).map(|mib| number(mib, 1)), row.missing(plan.plan)));
        let which = [(row.index + 1).to_string(), row.scene.name.clone(), row.label()];
        which.into_iter().chain(cells).collect()
    });
    Table::new("3.30", "All algorithms: required memory, MiB (not in the thesis)", &columns)
        .note("Allocated bytes, as counted. The thesis prints no memory figure.")
        .rows(rows)
}

/// Table 3.31, ours.
pub(super) fn all_reliability(results: &Results<'_>) -> Table {
    let columns = "R all, px | R non-occluded, px | B>1 all, % | B>1 non-occluded, % | energy";
    let title = "All algorithms: reliability (not in the thesis)".to_owned();
    table(results, "3.31", title, &thesis_plans(), columns, |row, plan| match row.measured(plan.plan) {
        None => vec![row.missing(plan.plan).to_owned()],
        Some(measured) => vec![
            number(measured.all.rmse, 2),
            number(measured.visible.rmse, 2),
            number(measured.all.bad[1], 2),
            number(measured.visible.bad[1], 2),
            whole(measured.energy.total),
        ],
    })
    .note("The thesis prints no reliability figure.")
}
