//! A sweep reports its progress band by band, and stops at the next one.

use std::ops::ControlFlow;

use bp_core::{
    Algorithm, Backend, Driver, Error, Model, Plan, Profile, Progress, Schedule, Settings, Side, Size, StereoPair,
};
use bp_cpu_rayon::Rayon;
use bp_testkit::noise_pair;

const SIZE: Size = Size { width: 90, height: 700 };

fn driver() -> Result<(Driver, StereoPair), Error> {
    let settings = Settings { label_sets: true, ..Algorithm::Sweep.settings(SIZE, 1, 1, Schedule::Sweep) };
    let plan = Plan::new(SIZE, Model::new(Profile::Census, 40)?, settings)?;
    Ok((Driver::new(Rayon.open(0)?.as_ref(), plan)?, noise_pair(SIZE.width, SIZE.height, 1)))
}

#[test]
fn progress_comes_at_least_as_often_as_bands_of_the_finest_grid_and_ends_at_the_total() {
    let (mut driver, pair) = driver().unwrap();
    let mut seen = Vec::new();
    let observer = &mut |progress: Progress| {
        seen.push((progress.done, progress.total));
        ControlFlow::Continue(())
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| driver.solve_observed(&pair, observer)).unwrap();
    let total = driver.plan().message_updates();
    assert!(seen.is_sorted() && seen.last() == Some(&(total, total)));
    assert!(seen.len() >= SIZE.height / 32, "{}", seen.len());
}

#[test]
fn a_sweep_stops_before_it_has_done_all_bands() {
    let (mut driver, pair) = driver().unwrap();
    driver.solve(&pair).unwrap();
    let all = driver.message_updates();
    for threads in [1, 2, 8] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let first_band = &mut |progress: Progress| match progress.done {
            0 => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
        };
        let stopped = pool.install(|| driver.solve_observed(&pair, first_band));
        assert_eq!(stopped.err(), Some(Error::Stopped));
        assert!(driver.message_updates() < all / 2, "{threads} threads: {} of {all}", driver.message_updates());
        assert!(driver.messages(Side::Up).unwrap().iter().all(|&message| message == 0), "there is no answer");
    }
    driver.solve(&pair).unwrap();
    assert_eq!(driver.message_updates(), all);
}
