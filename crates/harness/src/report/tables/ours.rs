//! Tables that the thesis does not have.

use super::{Named, Table, thesis_plans};
use crate::{
    record::Measurement,
    report::{
        format::{number, or, whole},
        results::{Part, Results},
    },
};

/// Number of the table of means, the only one with times of our plans.
pub(super) const PROFILES: &str = "A.1";

/// A plan of ours. The census transform gives the data costs of all pixels.
const fn own(look: usize, plan: &'static str, title: &'static str, meaning: &'static str) -> Named {
    Named { plan, title, printed: None, look, meaning }
}

pub(in crate::report) const CENSUS: Named =
    own(7, "census", "census (ours)", "census costs, 5 grids with 2 loops each");

const HIERARCHY: Named =
    own(8, "hierarchy", "hierarchy (ours)", "census costs, 5 grids with 10 half-steps each (schedule checkerboard)");

const SWEEP: Named = own(9, "sweep", "sweep (ours)", "census costs, 5 grids with 1 sweep each");

const SWEEP_ALL_LABELS: Named =
    own(10, "sweep-all-labels", "sweep, all labels (ours)", "as sweep, but no grid leaves out unlikely labels");

/// The thesis's plans, and our plans that were run.
pub(in crate::report) fn all_plans(results: &Results<'_>) -> Vec<Named> {
    let run = |plan: &Named| results.record.cells.iter().any(|cell| cell.plan == plan.plan);
    thesis_plans().into_iter().chain([CENSUS, HIERARCHY, SWEEP, SWEEP_ALL_LABELS].into_iter().filter(run)).collect()
}

/// Means over the scenes for every plan.
pub(super) fn profiles(results: &Results<'_>) -> Table {
    let columns: Vec<_> = "backend | plan | B>1 non-occluded, % | B>1 all, % | R all, px | \
                           message passing, ms | total, ms | energy / 1000"
        .split(" | ")
        .collect();
    let plans = all_plans(results);
    let rows = results.backends().flat_map(|backend| plans.iter().map(move |plan| (backend, plan)));
    let rows = rows.map(|(backend, plan)| {
        let none = results.missing_mean(backend, plan.plan, "not run");
        let mean = |of: fn(&Measurement) -> f64| results.mean(backend, |row| row.measured(plan.plan).map(of));
        let time = |part| results.mean(backend, |row| Some(row.time(plan.plan, part)?.median));
        let cells = [
            mean(|measured| measured.visible.bad[1]),
            mean(|measured| measured.all.bad[1]),
            mean(|measured| measured.all.rmse),
            time(Part::MessagePassing),
            time(Part::Total),
        ];
        let cells = cells.map(|mean| or(mean.map(|mean| number(mean, 2)), none));
        let energy = mean(|measured| measured.energy.total as f64);
        let energy = or(energy.map(|energy| number(energy / 1000.0, 0)), none);
        [vec![results.label(backend), plan.title.to_owned()], cells.to_vec(), vec![energy]].concat()
    });
    let note = "Means over the scenes; with several samples, means of medians. The thesis's plans use its grey difference as \
                data cost. Ours use the 3x3 census transform, which CTBP computes for one pixel only. Energies can be \
                compared only between plans with the same data cost. On the backend rayon, message passing of a sweep \
                includes computing its data costs again and selecting its labels.";
    Table::new(PROFILES, "Accuracy and time, means (not in the thesis)", &columns).note(note).rows(rows)
}

/// Labellings by others and by this program under one energy; `None` if the record holds none.
pub(super) fn energies(results: &Results<'_>) -> Option<Table> {
    let labellings = &results.record.labellings;
    if labellings.is_empty() {
        return None;
    }
    let rows = labellings.iter().map(|labelling| {
        let energy = &labelling.energy;
        vec![
            labelling.scene.clone(),
            labelling.method.clone(),
            if labelling.ours { "this program" } else { "reference" }.to_owned(),
            whole(energy.total),
            whole(energy.data),
            whole(energy.smoothness),
        ]
    });
    let note = "Profile mrf, 16 labels: the sum of absolute colour differences plus 20 min(|a - b|, 2). The references are \
                label maps made by the Middlebury MRF code (Szeliski et al. 2008) from the same images, all-zero labels, \
                and the cheapest label of each pixel (WTA, winner takes all). Their energies are computed here from the \
                maps. This program ran plain BP with the schedule checkerboard.";
    let columns = ["scene", "method", "labels by", "energy", "data", "smoothness"];
    let table = Table::new("A.2", "Energies beside those of other optimisers (not in the thesis)", &columns)
        .note(note)
        .rows(rows);
    Some(Table { data: Some("Middlebury 2001 and 2003 (tsukuba, venus, teddy), L = 16".to_owned()), ..table })
}
