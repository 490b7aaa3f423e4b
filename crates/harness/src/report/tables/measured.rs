//! One algorithm: speed, memory, reliability.

use super::{Named, Table, family};
use crate::{
    record::{Cell, Errors},
    report::{
        format::{mebibytes, number, or, whole},
        results::{Part, Results, Row},
    },
};

pub(super) const NOT_PRINTED: &str = "not printed";

/// A table with a row for every scene, backend and plan. `columns` follow those that identify the row.
pub(super) fn table<'a>(
    results: &'a Results<'a>,
    number: &str,
    title: String,
    plans: &[Named],
    columns: &str,
    cells: impl Fn(&Row<'a>, &Named) -> Vec<String>,
) -> Table {
    let which = |row: &Row<'_>, plan: &Named| {
        vec![(row.index + 1).to_string(), row.scene.name.clone(), row.label(), plan.title.to_owned()]
    };
    let rows = results.rows().flat_map(|row| plans.iter().map(move |plan| (row, plan)));
    let rows = rows.map(|(row, plan)| [which(&row, plan), cells(&row, plan)].concat());
    let columns: Vec<_> = ["#", "scene", "backend", "plan"].into_iter().chain(columns.split(" | ")).collect();
    Table::new(number, title, &columns).rows(rows)
}

/// Tables 3.3, 3.6, 3.9, 3.12, 3.15.
pub(super) fn speed(results: &Results<'_>, number: &str, plans: &[Named]) -> Table {
    let columns = "grids x loops | printed, ms | ours: message passing, ms | total, ms | samples";
    let title = format!("{}: processing speed", family(plans));
    let note = "Times are medians, with their range from three samples on. Message passing is the stages refine and \
                update_messages. The total goes from the images to the labels.";
    let table = table(results, number, title, plans, columns, |row, plan| {
        let printed = plan.printed.and_then(|name| results.thesis.time_ms(name, row.index));
        let time = |part| or(row.time(plan.plan, part).map(|time| time.to_string()), row.missing(plan.plan));
        vec![
            or(row.cell(plan.plan).map(grids_and_loops), ""),
            or(printed.map(|ms| format!("{ms}")), NOT_PRINTED),
            time(Part::MessagePassing),
            time(Part::Total),
            or(row.measured(plan.plan).map(|measured| measured.samples.len().to_string()), "0"),
        ]
    });
    let cut = plans.iter().any(Named::is_cut);
    table.note(format!("{note}{}", if cut { PARTS } else { "" }))
}

/// How the parts of a cut image share the workers.
const PARTS: &str = " If a title says no more, all workers share the whole image, as in BP. Side by side, each part has a \
                     plan of its own, and workers of one thread take one part after another. In turn, all workers share \
                     one part after another, in the memory of one part.";

fn grids_and_loops(cell: &Cell) -> String {
    format!("{} x {}", cell.settings.grids, cell.settings.steps_per_grid)
}

/// Tables 3.4, 3.7, 3.10, 3.13, 3.16.
pub(super) fn memory(results: &Results<'_>, number: &str, plans: &[Named]) -> Table {
    let columns = "printed | ours: predicted, MiB | allocated, MiB";
    let title = format!("{}: required memory", family(plans));
    let note = "The plan's formulas predict memory before the run; allocated bytes are counted. The thesis prints no memory \
                figure.";
    table(results, number, title, plans, columns, |row, plan| {
        let allocated = row.measured(plan.plan).map(|measured| measured.allocated_bytes);
        vec![
            NOT_PRINTED.to_owned(),
            or(row.cell(plan.plan).and_then(|cell| cell.settings.planned_bytes).map(mib), ""),
            or(allocated.map(mib), row.missing(plan.plan)),
        ]
    })
    .note(note)
}

/// Bytes in MiB, as a table shows them.
pub(super) fn mib(bytes: u64) -> String {
    number(mebibytes(bytes), 1)
}

/// Tables 3.5, 3.8, 3.11, 3.14, 3.17.
pub(super) fn reliability(results: &Results<'_>, number: &str, plans: &[Named]) -> Table {
    let columns = "printed | R all | B>0.5 all | B>1 all | B>2 all | B>4 all | R non-occluded | B>0.5 non-occluded | \
                   B>1 non-occluded | B>2 non-occluded | B>4 non-occluded | energy | schedule";
    let title = format!("{}: reliability", family(plans));
    let note = "R is the root mean squared error in pixels (equation 2.82). B>1 is the percentage of pixels wrong by more \
                than 1 px (2.83). Both are over all pixels of known truth and over the non-occluded ones, which both \
                cameras see. The energy depends on the schedule: after the same number of loops, plain BP's is much \
                higher under sync than under checkerboard. The thesis prints no reliability figure.";
    table(results, number, title, plans, columns, |row, plan| {
        let Some(measured) = row.measured(plan.plan) else {
            return vec![NOT_PRINTED.to_owned(), row.missing(plan.plan).to_owned()];
        };
        let mut cells = vec![NOT_PRINTED.to_owned()];
        cells.extend(errors(&measured.all));
        cells.extend(errors(&measured.visible));
        cells.push(whole(measured.energy.total));
        cells.push(or(row.cell(plan.plan).map(|cell| cell.settings.schedule.clone()), ""));
        cells
    })
    .note(note)
}

fn errors(errors: &Errors) -> Vec<String> {
    let bad = errors.bad.iter().map(|&bad| number(bad, 2));
    std::iter::once(number(errors.rmse, 2)).chain(bad).collect()
}
