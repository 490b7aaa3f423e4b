//! A solver keeps to its limit to the byte, though nobody knows before how much label sets need.

use std::ops::ControlFlow;

use bp_core::{Algorithm, Backend, Error, Model, Plan, Profile, Schedule, Settings, Size, Solver, never};
use bp_cpu_rayon::Rayon;
use bp_testkit::noise_pair;

const SIZE: Size = Size { width: 200, height: 170 };

/// Solves a pair within so many bytes. Returns the bytes held in the end, and the result.
fn solve_within(bytes: u64) -> Result<(u64, Result<(), Error>), Error> {
    let settings = Settings { label_sets: true, ..Algorithm::Sweep.settings(SIZE, 1, 1, Schedule::Sweep) };
    let plan = Plan::new(SIZE, Model::new(Profile::Census, 90)?, settings)?;
    rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("three threads").install(|| {
        let mut solver: Box<dyn Solver> = Rayon.open(0)?.prepare(&plan, &never)?;
        solver.limit_bytes(bytes);
        solver.match_cost(&noise_pair(SIZE.width, SIZE.height, 1), None)?;
        (1..plan.grids()).try_for_each(|grid| solver.coarsen(grid))?;
        let passed = solver.pass_messages(0..plan.grids(), &mut |_| ControlFlow::Continue(()));
        Ok((solver.allocated_bytes(), passed.map(drop)))
    })
}

#[test]
fn what_a_solve_needs_is_enough_and_a_byte_less_is_not() {
    let (needed, result) = solve_within(u64::MAX).unwrap();
    assert_eq!(result, Ok(()));
    assert_eq!(solve_within(needed).unwrap(), (needed, Ok(())));
    let (held, refused) = solve_within(needed - 1).unwrap();
    assert!(matches!(refused, Err(Error::OutOfMemory { available: Some(_), .. })), "{refused:?}");
    assert!(held < needed);
}
