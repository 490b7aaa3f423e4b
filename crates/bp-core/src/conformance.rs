//! The suite that every backend passes: labels and messages equal to the bit, on every kind of plan.
//!
//! A backend's own test names the backend and calls [`assert_same_on_all`], against [`Oracle`] or a backend that is
//! itself held against it.

mod oracle;

pub use oracle::Oracle;

use crate::{
    Algorithm, Backend, Error, Image, Matcher, MessageStart, Model, Plan, Profile, Schedule, Settings, Side, Size,
    StereoPair,
};

/// A pair and a plan for it.
#[derive(Clone, Debug)]
pub struct Case {
    /// The pair.
    pub pair: StereoPair,
    /// The plan.
    pub plan: Plan,
}

/// What a backend answered: labels [height][width], and what was received from each of [`Side::ALL`],
/// [height][width][labels].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Labels.
    pub labels: Vec<u16>,
    /// Messages.
    pub messages: [Vec<u8>; 4],
}

/// Solves a case on the first device of a backend.
///
/// # Errors
/// Those of the backend.
pub fn solve(backend: &dyn Backend, case: &Case) -> Result<Answer, Error> {
    let device = backend.open(0)?;
    let mut matcher = Matcher::new(device.as_ref(), case.plan.clone())?;
    matcher.solve(&case.pair)?;
    let [left, right, up, down] = Side::ALL;
    let messages = [matcher.messages(left)?, matcher.messages(right)?, matcher.messages(up)?, matcher.messages(down)?];
    Ok(Answer { labels: matcher.labels().to_vec(), messages })
}

/// Asserts that two backends give the same labels and messages on a case.
///
/// # Panics
/// Where one fails, or they differ; the message names the case and the first node that differs.
pub fn assert_same(reference: &dyn Backend, tested: &dyn Backend, case: &Case) {
    let answer = |backend: &dyn Backend| match solve(backend, case) {
        Ok(answer) => answer,
        Err(error) => panic!("{} failed: {error}\n{:?}", backend.name(), case.plan),
    };
    let (expected, found) = (answer(reference), answer(tested));
    let (width, labels) = (case.pair.size().width, case.plan.model().labels());
    for ((expected, found), side) in expected.messages.iter().zip(&found.messages).zip(Side::ALL) {
        if let Some(i) = first_difference(expected, found) {
            let (node, label) = (i / labels, i % labels);
            let place = format!("({}, {}) from {side:?}, label {label}", node % width, node / width);
            panic!("message at {place}: {} instead of {}\n{:?}", found[i], expected[i], case.plan);
        }
    }
    if let Some(i) = first_difference(&expected.labels, &found.labels) {
        let (expected, found) = (expected.labels[i], found.labels[i]);
        panic!("label at ({}, {}): {found} instead of {expected}\n{:?}", i % width, i / width, case.plan);
    }
}

fn first_difference<T: PartialEq>(expected: &[T], found: &[T]) -> Option<usize> {
    assert_eq!(expected.len(), found.len());
    expected.iter().zip(found).position(|(a, b)| a != b)
}

/// [`assert_same`] on [`cases`].
///
/// # Panics
/// As [`assert_same`].
pub fn assert_same_on_all(reference: &dyn Backend, tested: &dyn Backend) {
    cases().for_each(|case| assert_same(reference, tested, &case));
}

/// Every algorithm, profile, schedule and message start at tiny, odd and prime sizes, with few and many labels, and
/// with the smoothness that strains 8 bits most.
pub fn cases() -> impl Iterator<Item = Case> {
    let sizes = [(1, 1), (1, 5), (7, 1), (2, 3), (5, 4), (13, 11), (17, 8)];
    let shapes = sizes.into_iter().flat_map(|size| [1, 2, 3, 16].map(|labels| (size, labels)));
    let many = [64, 112, 256, 300].map(|labels| ((5, 3), labels));
    shapes.chain(many).flat_map(|((width, height), labels)| {
        let pair = noise_pair(width, height, labels as u64);
        models(labels).into_iter().flat_map(move |model| {
            let pair = pair.clone();
            settings(pair.size()).into_iter().filter_map(move |settings| {
                let plan = Plan::new(pair.size(), model, settings).ok()?;
                Some(Case { pair: pair.clone(), plan })
            })
        })
    })
}

fn models(labels: usize) -> Vec<Model> {
    let of = |profile| Model::new(profile, labels).into_iter();
    let strained = [(1, 63), (63, 63), (255, 63), (0, 5), (3, 0)];
    let plain = Profile::ALL.into_iter().flat_map(of);
    let strained = strained.into_iter().flat_map(move |(slope, truncation)| {
        of(Profile::Mrf).filter_map(move |model| model.with_smoothness(slope, truncation).ok())
    });
    let negative = of(Profile::Census).filter_map(|model| model.with_min_disparity(-2).ok());
    plain.chain(strained).chain(negative).collect()
}

fn settings(size: Size) -> Vec<Settings> {
    let mut all = Vec::new();
    for schedule in Schedule::ALL {
        all.extend(Algorithm::ALL.map(|algorithm| algorithm.settings(size, 7, 2, schedule)));
        let hierarchy = Algorithm::Cfbp.settings(size, 7, 1, schedule);
        all.extend(MessageStart::ALL.map(|message_start| Settings { grids: 3, steps: 3, message_start, ..hierarchy }));
    }
    all
}

/// A pair of coloured noise, the same for the same arguments. Blocks of 4x4 pixels are shifted by 0, 1 or 2, so that
/// children of a coarse node disagree strongly; every fifth pixel matches nothing.
///
/// # Panics
/// Where the size is no image's.
#[must_use]
pub fn noise_pair(width: usize, height: usize, seed: u64) -> StereoPair {
    let hash = |i: u64| {
        let mut z = (seed << 32 ^ i).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z ^ (z >> 27)
    };
    let view = |right: bool| {
        let pixel = |i: usize| {
            let shift = if right { (i % width / 4 + i / width / 4) % 3 } else { 0 };
            let unmatched = right && i.is_multiple_of(5);
            let [r, g, b, ..] = hash(if unmatched { !(i as u64) } else { (i + shift) as u64 }).to_le_bytes();
            [r, g, b]
        };
        Image::from_rgb(width, height, (0..width * height).map(pixel).collect())
    };
    let pair = view(false).and_then(|left| StereoPair::new(left, view(true)?));
    pair.unwrap_or_else(|error| panic!("{error}"))
}
