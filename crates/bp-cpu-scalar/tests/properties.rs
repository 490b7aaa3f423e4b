//! Properties that every implementation of belief propagation must satisfy.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::ops::ControlFlow;

use bp_core::{
    Algorithm, BAND_ROWS, Backend, Cut, DataCost, Driver, Energy, Error, Image, MessageStart, Model, Plan, Profile,
    Schedule, Seam, Settings, Size, StereoPair,
};
use bp_cpu_scalar::Scalar;
use bp_testkit::{Answer, Case, Oracle, compare, noise_pair, solve};
use proptest::prelude::*;

fn plan_settings(grids: u32, steps: u32, schedule: Schedule) -> Settings {
    Settings {
        grids,
        steps,
        schedule,
        message_start: MessageStart::Receiver,
        cut: None,
        coarse_clip: false,
        label_sets: false,
    }
}

fn answer(pair: &StereoPair, model: Model, settings: Settings) -> Answer {
    let plan = Plan::new(pair.size(), model, settings).unwrap();
    solve(&Scalar, &Case { pair: pair.clone(), plan }).unwrap()
}

fn any_model(labels: std::ops::Range<usize>) -> impl Strategy<Value = Model> {
    let profile = prop::sample::select(Profile::ALL.to_vec());
    let weak = prop::option::of(0..120_u8);
    (profile, labels, any::<u8>(), 0..=63_u8, -3..4_i32, weak).prop_map(|(profile, labels, slope, k, min, weak)| {
        let model = Model::new(profile, labels).unwrap().with_min_disparity(min).unwrap();
        let model = model.with_smoothness(slope, k).unwrap();
        weak.map_or(model, |threshold| model.with_edges_halved_above(threshold))
    })
}

fn any_settings(size: Size) -> impl Strategy<Value = Settings> {
    let schedule = prop::sample::select(Schedule::ALL.to_vec());
    let start = prop::sample::select(MessageStart::ALL.to_vec());
    let cut = prop::option::of((0..size.width, 0..size.height, any::<bool>()));
    (1..5_u32, 1..6_u32, schedule, start, cut, any::<(bool, bool)>()).prop_map(
        |(grids, steps, schedule, start, cut, (coarse_clip, label_sets))| {
            let cut = cut.map(|(x, y, seed_start)| Cut { x, y, seed_start });
            let grids = if cut.is_some() { 1 } else { grids };
            let message_start = if schedule == Schedule::Sweep { MessageStart::Receiver } else { start };
            let label_sets = label_sets && schedule == Schedule::Sweep;
            Settings { grids, steps, schedule, message_start, cut, coarse_clip, label_sets }
        },
    )
}

fn any_case() -> impl Strategy<Value = Case> {
    // Sometimes tall enough for several bands of the schedule `sweep`.
    let height = prop_oneof![3 => 1..9_usize, 1 => 30..70_usize];
    (1..9_usize, height, any::<u32>(), any_model(1..20)).prop_flat_map(|(width, height, seed, model)| {
        let pair = noise_pair(width, height, seed.into());
        any_settings(pair.size()).prop_map(move |settings| Case {
            plan: Plan::new(pair.size(), model, settings).unwrap(),
            pair: pair.clone(),
        })
    })
}

/// The least energy over all labellings of a chain in which node p has label d, `[node][label]`.
fn min_marginals(pair: &StereoPair, model: &Model, nodes: &[(usize, usize)]) -> Vec<Vec<i64>> {
    let cost = DataCost::of_pair(pair, *model).unwrap();
    let grey = |(x, y)| pair.left().grey(x, y);
    let labels = 0..model.labels() as u16;
    let data = |&(x, y): &(usize, usize)| labels.clone().map(|d| i64::from(cost.at(x, y, d))).collect::<Vec<_>>();
    // For each label of a node, the least energy of all nodes before it.
    let before = |order: &[(usize, usize)]| {
        let mut sums = vec![vec![0; model.labels()]];
        for edge in order.windows(2) {
            let so_far = sums[sums.len() - 1].iter().zip(data(&edge[0])).map(|(sum, cost)| sum + cost);
            let so_far: Vec<i64> = so_far.collect();
            let smoothness = model.smoothness_between(grey(edge[0]), grey(edge[1]));
            let reach = |d: u16| {
                let offers = labels.clone().map(|a| so_far[usize::from(a)] + i64::from(smoothness.of(a, d)));
                offers.min().unwrap()
            };
            sums.push(labels.clone().map(reach).collect());
        }
        sums
    };
    let backwards: Vec<_> = nodes.iter().rev().copied().collect();
    let (ahead, behind) = (before(nodes), before(&backwards));
    let all = ahead.into_iter().zip(behind.into_iter().rev()).zip(nodes);
    all.map(|((ahead, behind), node)| {
        ahead.iter().zip(behind).zip(data(node)).map(|((ahead, behind), cost)| ahead + behind + cost).collect()
    })
    .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn u8_equals_unbounded_integers(case in any_case()) {
        compare(&Oracle, &Scalar, &case).unwrap();
    }

    /// On a chain, belief propagation is dynamic programming: beliefs are min-marginals up to a constant per node.
    #[test]
    fn a_chain_is_solved_exactly(
        len in 1..12_usize, upright in any::<bool>(), seed in any::<u32>(), model in any_model(1..9),
    ) {
        let (width, height) = if upright { (1, len) } else { (len, 1) };
        let pair = noise_pair(width, height, seed.into());
        let answer = answer(&pair, model, plan_settings(1, len as u32, Schedule::Sync));
        let cost = DataCost::of_pair(&pair, model).unwrap();
        let nodes: Vec<_> = (0..len).map(|i| (i % width, i / width)).collect();
        let marginals = min_marginals(&pair, &model, &nodes);
        let mut unique = true;
        for (node, (&(x, y), marginals)) in nodes.iter().zip(&marginals).enumerate() {
            let received = |d: usize| -> i64 {
                answer.messages.iter().map(|side| i64::from(side[node * model.labels() + d])).sum()
            };
            let beliefs: Vec<_> = (0..model.labels()).map(|d| i64::from(cost.at(x, y, d as u16)) + received(d)).collect();
            let (least, least_energy) = (*beliefs.iter().min().unwrap(), *marginals.iter().min().unwrap());
            let above: Vec<_> = beliefs.iter().map(|belief| belief - least).collect();
            prop_assert_eq!(&above, &marginals.iter().map(|energy| energy - least_energy).collect::<Vec<_>>());
            unique &= above.iter().filter(|&&above| above == 0).count() == 1;
        }
        if unique {
            let energy = Energy::of(&pair, &model, &answer.labels).unwrap().total();
            prop_assert_eq!(energy as i64, *marginals[0].iter().min().unwrap());
        }
    }

    /// In a column of one band, a loop of sweeps is dynamic programming: messages go up, then labels are decided down.
    #[test]
    fn one_sweep_solves_a_column_of_one_band_exactly(
        height in 1..=BAND_ROWS, seed in any::<u32>(), model in any_model(1..9),
    ) {
        let pair = noise_pair(1, height, seed.into());
        let labels = answer(&pair, model, plan_settings(1, 1, Schedule::Sweep)).labels;
        let nodes: Vec<_> = (0..height).map(|y| (0, y)).collect();
        let marginals = min_marginals(&pair, &model, &nodes);
        let energy = Energy::of(&pair, &model, &labels).unwrap().total();
        prop_assert_eq!(energy as i64, *marginals[0].iter().min().unwrap());
    }

    /// On one grid, a band depends on no rows below those that prepare the seam below it.
    #[test]
    fn a_band_depends_on_few_rows_of_the_next_one(
        width in 1..9_usize, steps in 1..3_u32, seed in any::<u32>(), model in any_model(1..9),
    ) {
        let pair = noise_pair(width, 3 * BAND_ROWS, seed.into());
        let settings = plan_settings(1, steps, Schedule::Sweep);
        let two_bands = 2 * BAND_ROWS * width;
        let Some(seam) = Seam::all(pair.size().height).last() else { panic!("three bands have two seams") };
        let labels = |end| answer(&pair.strip(0..end), model, settings).labels[..two_bands].to_vec();
        prop_assert_eq!(labels(seam.rows_below().end), labels(pair.size().height));
    }

    /// After a loop of sweeps every edge holds one message: upward, or towards its even end.
    #[test]
    fn a_sweep_leaves_one_message_an_edge(
        width in 1..9_usize, height in 1..70_usize, grids in 1..4_u32, seed in any::<u32>(), model in any_model(2..9),
    ) {
        let pair = noise_pair(width, height, seed.into());
        let [left, right, up, _] = answer(&pair, model, plan_settings(grids, 1, Schedule::Sweep)).messages;
        prop_assert!(up.iter().all(|&message| message == 0));
        for messages in [left, right] {
            for (node, message) in messages.chunks(model.labels()).enumerate() {
                let odd = (node % width + node / width) % 2 == 1;
                prop_assert!(!odd || message.iter().all(|&message| message == 0));
            }
        }
    }

    /// The grid is bipartite: T half-steps from zero give one colour of T synchronous loops.
    #[test]
    fn half_steps_are_half_of_the_synchronous_loops(
        width in 1..9_usize, height in 1..9_usize, steps in 1..7_u32, seed in any::<u32>(), model in any_model(1..9),
    ) {
        let pair = noise_pair(width, height, seed.into());
        let sync = answer(&pair, model, plan_settings(1, steps, Schedule::Sync)).labels;
        let half = answer(&pair, model, plan_settings(1, steps, Schedule::Checkerboard)).labels;
        for node in (0..width * height).filter(|node| (node % width + node / width + steps as usize).is_multiple_of(2)) {
            prop_assert_eq!(half[node], sync[node]);
        }
    }

    #[test]
    fn one_part_or_one_grid_is_plain_bp(
        width in 1..9_usize, height in 1..9_usize, seed in any::<u32>(), model in any_model(1..9),
    ) {
        let pair = noise_pair(width, height, seed.into());
        let bp = plan_settings(1, 4, Schedule::Sync);
        let one_part = Settings { cut: Some(Cut { x: 0, y: 0, seed_start: false }), ..bp };
        prop_assert_eq!(answer(&pair, model, bp), answer(&pair, model, one_part));
        let one_grid = Algorithm::Cfbp.settings(Size { width: 3, height: 3 }, 8, 2, Schedule::Sync);
        prop_assert_eq!((one_grid.grids, one_grid.steps), (1, 4));
        prop_assert_eq!(answer(&pair, model, bp), answer(&pair, model, one_grid));
    }

    /// The order of rows does not matter. (The order of columns does, because disparities have a direction.)
    #[test]
    fn a_pair_upside_down_gives_the_map_upside_down(
        width in 1..9_usize, height in 1..9_usize, steps in 1..7_u32, seed in any::<u32>(), model in any_model(1..9),
    ) {
        let pair = noise_pair(width, height, seed.into());
        let turn = |image: &Image| {
            let rows: Vec<_> = image.pixels().chunks(width).rev().flatten().copied().collect();
            Image::from_rgb(width, height, rows).unwrap()
        };
        let turned = StereoPair::new(turn(pair.left()), turn(pair.right())).unwrap();
        let settings = plan_settings(1, steps, Schedule::Sync);
        let expected: Vec<_> = answer(&pair, model, settings).labels.chunks(width).rev().flatten().copied().collect();
        prop_assert_eq!(answer(&turned, model, settings).labels, expected);
    }

    /// The contents of one part of a cut image do not affect the other parts.
    #[test]
    fn no_message_crosses_a_cut(
        width in 2..9_usize, height in prop_oneof![2..9_usize, Just(2 * BAND_ROWS)], seed in any::<u32>(), labels in 1..9_usize,
    ) {
        let model = Model::new(Profile::Thesis, labels).unwrap();
        let pair = noise_pair(width, height, seed.into());
        let cut = Cut { seed_start: false, ..Cut::at_centre(pair.size()) };
        let inside = |node: usize| node % width < cut.x && node / width < cut.y;
        let pixels = pair.left().pixels();
        let changed = pixels.iter().enumerate().map(|(node, &pixel)| if inside(node) { pixel.map(|v| !v) } else { pixel }).collect();
        let left = Image::from_rgb(width, height, changed).unwrap();
        let other = StereoPair::new(left, pair.right().clone()).unwrap();
        for schedule in [Schedule::Checkerboard, Schedule::Sweep] {
            let settings = Settings { cut: Some(cut), ..plan_settings(1, 9, schedule) };
            let (a, b) = (answer(&pair, model, settings), answer(&other, model, settings));
            for node in (0..width * height).filter(|&node| !inside(node)) {
                prop_assert_eq!(a.labels[node], b.labels[node]);
            }
        }
    }
}

#[test]
fn a_shifted_random_dot_pair_gives_the_shift() {
    let dots = |x: usize, y: usize| if (x * x * 7 + x * y * 13 + y * 31 + x * 5) % 11 < 5 { 230 } else { 20 };
    let view = |shift: usize| {
        let pixels: Vec<u8> = (0..40 * 24).map(|i| dots(i % 40 + shift, i / 40)).collect();
        Image::from_grey(40, 24, pixels).unwrap()
    };
    let pair = StereoPair::new(view(0), view(5)).unwrap();
    for (profile, algorithm) in Profile::ALL.into_iter().flat_map(|p| Algorithm::ALL.map(|a| (p, a))) {
        let model = Model::new(profile, 12).unwrap();
        let labels = answer(&pair, model, algorithm.settings(pair.size(), 24, 2, Schedule::Sync)).labels;
        let inner = (0..40 * 24).filter(|i| i % 40 >= 12);
        let wrong = inner.filter(|&i| labels[i] != 5).count();
        assert!(wrong <= 8, "{} {}: {wrong} of 672 pixels", profile.name(), algorithm.name());
    }
}

/// Black against white gives the highest costs, and 14 grids reach the widest sums.
#[test]
fn sums_hold_the_extreme_costs() {
    let view = |value| Image::from_grey(67, 33, [value; 67 * 33]).unwrap();
    let pair = StereoPair::new(view(255), view(0)).unwrap();
    for profile in Profile::ALL {
        let plan = Plan::new(pair.size(), Model::new(profile, 4).unwrap(), plan_settings(14, 1, Schedule::Sync));
        compare(&Oracle, &Scalar, &Case { pair: pair.clone(), plan: plan.unwrap() }).unwrap();
    }
}

#[test]
fn a_solve_tells_its_progress_and_can_be_stopped() {
    let pair = noise_pair(9, 9, 3);
    let model = Model::new(Profile::Census, 5).unwrap();
    let plan = Plan::new(pair.size(), model, plan_settings(2, 3, Schedule::Checkerboard)).unwrap();
    let mut driver = Driver::new(&Scalar, plan.clone()).unwrap();
    let mut calls = Vec::new();
    let mut stop_at = |stop| {
        calls.clear();
        let outcome = driver.solve_observed(&pair, &mut |progress| {
            calls.push(progress.done);
            if calls.len() == stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        (outcome.map(drop), calls.clone())
    };
    let (outcome, calls) = stop_at(4);
    assert_eq!((outcome, calls.len()), (Err(Error::Stopped), 4));
    let (outcome, calls) = stop_at(0);
    assert_eq!((outcome, calls.last()), (Ok(()), Some(&plan.message_updates())));
    assert!(calls.is_sorted());
    assert!(driver.solve(&noise_pair(8, 9, 3)).is_err());
    assert!(Scalar.open(1).is_err());
}
