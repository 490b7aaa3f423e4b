//! Tables that the thesis has no counterpart of.

use super::{Named, Table, thesis_plans};
use crate::report::{
    format::{Spread, number, or, whole},
    results::{Part, Results, Row},
};

/// Number of the table of means, the only one with times of plans that the thesis has not.
pub(super) const PROFILES: &str = "A.1";

/// Our plan with census costs.
pub(in crate::report) const CENSUS: Named =
    Named { plan: "census", title: "ours: census cost, 5 grids x 2 loops", printed: None };

const HIERARCHY: Named =
    Named { plan: "hierarchy", title: "ours: census cost, 5 grids x 10 half-steps (checkerboard)", printed: None };

const SWEEP: Named = Named { plan: "sweep", title: "ours: census cost, 5 grids x 1 sweep", printed: None };

/// The thesis's plans, and those of ours that were run.
pub(in crate::report) fn all_plans(results: &Results<'_>) -> Vec<Named> {
    let run = |plan: &Named| results.record.cells.iter().any(|cell| cell.plan == plan.plan);
    thesis_plans().into_iter().chain([CENSUS, HIERARCHY, SWEEP].into_iter().filter(run)).collect()
}

/// Means over the scenes for every plan.
pub(super) fn profiles(results: &Results<'_>) -> Table {
    let columns = [
        "backend",
        "plan",
        "B>1 visible, %",
        "B>1 all, %",
        "R all, px",
        "message passing, ms",
        "total, ms",
        "energy / 1000",
    ];
    let plans = all_plans(results);
    let rows = results.backends().flat_map(|backend| plans.iter().map(move |plan| (backend, plan)));
    let rows = rows.map(|(backend, plan)| {
        let none = results.missing_mean(backend, plan.plan, "not run");
        let cells = means(results, backend, plan).map(|mean| or(mean.map(|mean| number(mean, 2)), none));
        let energy = or(mean_energy(results, backend, plan).map(|energy| number(energy / 1000.0, 0)), none);
        [vec![results.label(backend), plan.title.to_owned()], cells.to_vec(), vec![energy]].concat()
    });
    let note = "Means over the scenes, of medians where there are several samples. The thesis's plans use its grey \
                difference; ours use the 3x3 census transform that CTBP computes for one pixel as the data cost of all. \
                Energies of one data cost can be compared, those of the two cannot. On the backend rayon, message \
                passing of a sweep includes computing its data costs again and deciding its labels.";
    Table::new(PROFILES, "Accuracy and time, means (ours)", &columns).note(note).rows(rows)
}

/// Mean energy of a plan's labels.
fn mean_energy(results: &Results<'_>, backend: &str, plan: &Named) -> Option<f64> {
    let rows = results.rows().filter(|row| row.backend == backend);
    let energies: Option<Vec<f64>> = rows.map(|row| Some(row.measured(plan.plan)?.energy.total as f64)).collect();
    Spread::mean(energies?)
}

/// Mean visible and total bad-pixel percentage, error, message passing time and total time of a plan.
pub(in crate::report) fn means(results: &Results<'_>, backend: &str, plan: &Named) -> [Option<f64>; 5] {
    let rows: Vec<Row<'_>> = results.rows().filter(|row| row.backend == backend).collect();
    let mean = |value: &dyn Fn(&Row<'_>) -> Option<f64>| {
        let values: Option<Vec<f64>> = rows.iter().map(value).collect();
        Spread::mean(values?)
    };
    [
        mean(&|row| Some(row.measured(plan.plan)?.visible.bad[1])),
        mean(&|row| Some(row.measured(plan.plan)?.all.bad[1])),
        mean(&|row| Some(row.measured(plan.plan)?.all.rmse)),
        mean(&|row| Some(row.time(plan.plan, Part::MessagePassing)?.median)),
        mean(&|row| Some(row.time(plan.plan, Part::Total)?.median)),
    ]
}

/// Labellings by others and ours under one energy; none where the data held none.
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
    let note = "Profile mrf, 16 labels: sum of absolute colour differences + 20 min(|a - b|, 2). The references are label \
                maps made by the Middlebury MRF code (Szeliski et al. 2008) from the same images, all-zero labels, and the \
                cheapest label of each pixel (WTA); their energies are computed here from the maps. Ours runs plain BP \
                with the checkerboard schedule.";
    let columns = ["scene", "method", "labels by", "energy", "data", "smoothness"];
    let table = Table::new("A.2", "Energies beside those of other optimisers (ours)", &columns).note(note).rows(rows);
    Some(Table { data: Some("Middlebury 2001 and 2003 (tsukuba, venus, teddy), L = 16".to_owned()), ..table })
}
