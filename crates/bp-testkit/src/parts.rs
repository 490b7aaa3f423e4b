//! The parts of a cut image, solved with plans of their own, against the plan of the whole image.

use std::ops::ControlFlow;

use bp_core::{
    Algorithm, Cut, Device, Driver, Error, Model, Part, PartDriver, Parting, Profile, Schedule, Settings, Side, census,
    never,
};

use crate::{
    Answer, Case, Difference, Fault,
    difference::{SCRATCH_BYTES, same},
    noise_pair, solve,
};

/// Sizes with even and odd cuts, more labels than a part has columns, cuts along a border, and parts of one column or row.
fn cases() -> impl Iterator<Item = Case> {
    let sizes = [(40, 30, 12), (37, 21, 5), (23, 9, 30), (2, 2, 3), (3, 1, 4), (150, 3, 70), (1, 5, 2), (280, 4, 20)];
    let profiles = [Profile::Thesis, Profile::Mrf];
    sizes.into_iter().flat_map(move |size| profiles.map(|profile| (size, profile))).map(
        |((width, height, labels), profile)| {
            let pair = noise_pair(width, height, labels as u64);
            let settings = Algorithm::Ctbp.settings(pair.size(), 5, 1, Schedule::Sync);
            let cut = Cut { seed_start: labels % 2 == 0, ..Cut::at_centre(pair.size()) };
            let model = Model::new(profile, labels);
            let case = model.and_then(|model| Case::new(pair, model, Settings { cut: Some(cut), ..settings }));
            case.unwrap_or_else(|error| panic!("{error}"))
        },
    )
}

/// Checks that parts give the bits of the whole image.
pub(crate) fn compare_parts(reference: &dyn Device, tested: &dyn Device) -> Result<(), Difference> {
    cases().try_for_each(|case| {
        let failed = |error: Error| Difference::new(error.into(), &case.plan);
        let expected = solve(reference, &case).map_err(failed)?;
        let mut found = expected.clone();
        for part in Part::all(&case.plan).map_err(failed)? {
            let answer = solve_part(tested, &case, &part).map_err(failed)?;
            put(&part, &answer, &case, &mut found);
        }
        same(&expected, &found, &case)?;
        for parting in [Parting::SideBySide { workers: 1 }, Parting::SideBySide { workers: 3 }, Parting::InTurn] {
            compare_driver(tested, &case, &expected, parting).map_err(|fault| Difference::new(fault, &case.plan))?;
        }
        Ok(())
    })
}

fn solve_part(device: &dyn Device, case: &Case, part: &Part) -> Result<Answer, Error> {
    let seed = census::seed(&case.pair, &case.plan).and_then(|seed| part.seed(seed));
    let mut driver = Driver::new(device, part.plan().clone())?;
    driver.solve_seeded(&part.pair(&case.pair), seed, &mut |_| ControlFlow::Continue(()))?;
    Answer::of(&mut driver)
}

/// Replaces the answer of the part's nodes.
fn put(part: &Part, answer: &Answer, case: &Case, whole: &mut Answer) {
    let (width, labels, own) = (case.pair.size().width, case.plan.model().labels(), part.columns().len());
    for (row, y) in part.rows().enumerate() {
        let (from, to) = (row * own, y * width + part.columns().start);
        whole.labels[to..][..own].copy_from_slice(&answer.labels[from..][..own]);
        for side in Side::ALL {
            let messages = &answer.messages[side as usize][from * labels..][..own * labels];
            whole.messages[side as usize][to * labels..][..own * labels].copy_from_slice(messages);
        }
    }
}

/// Solves twice, because a driver of parts in turn has another part's memory the second time.
fn compare_driver(device: &dyn Device, case: &Case, expected: &Answer, parting: Parting) -> Result<(), Fault> {
    let planned = PartDriver::planned_bytes(device, &case.plan, parting)?;
    let mut driver = PartDriver::new(device, case.plan.clone(), parting)?;
    driver.solve(device, &case.pair, &never)?;
    driver.solve(device, &case.pair, &never)?;
    let allocated = driver.allocated_bytes();
    if allocated.abs_diff(planned) > 4 * SCRATCH_BYTES {
        return Err(Fault::Memory { allocated, planned });
    }
    let found = Answer { labels: driver.labels().to_vec(), ..expected.clone() };
    same(expected, &found, case).map_err(|difference| *difference.fault)
}
