//! Random cases, for plans that nobody thought of.

use fastrand::Rng;

use bp_core::{
    Cut, EdgeLevels, MAX_GRIDS, MAX_TRUNCATION, MessageStart, Model, Plan, Profile, Schedule, Settings, Size,
    Smoothness, image::APRON,
};

use crate::{Case, noise_pair};

/// The largest number of data costs of a case, unless one row has more. The reference takes 0.1 s for them.
const VOLUME: usize = 60_000;

/// A random case. The same seed gives the same case as long as `fastrand` does not change. Sizes lie around one and
/// several vectors, blocks, strips and bands, with fewer rows for many labels. Half of the pairs have an apron, a quarter a
/// margin, and half of the models have edges of several levels; see [`EdgeLevels`].
#[must_use]
pub fn random_case(seed: u64) -> Case {
    let mut random = Rng::with_seed(seed);
    let (model, width) = (model(&mut random), width(&mut random));
    let height = random.usize(1..80).min(1 + VOLUME / (width * model.labels()));
    let [above, below] = if random.bool() { [random.usize(..=APRON), random.usize(..=APRON)] } else { [0, 0] };
    let margin = if random.u8(..4) == 0 { random.usize(1..150) } else { 0 };
    let pair = noise_pair(margin + width, above + height + below, random.u32(..).into()).strip(above..above + height);
    let settings = settings(&mut random, width, height);
    let plan = Plan::new(Size { width, height }, model, settings).and_then(|plan| plan.with_margin(margin));
    Case { plan: plan.unwrap_or_else(|error| panic!("{error}")), pair }
}

fn width(random: &mut Rng) -> usize {
    match random.u8(..5) {
        0 => random.usize(1..20),
        1 => random.usize(60..70),
        2 => random.usize(120..135),
        3 => random.usize(250..300),
        _ => 1100,
    }
}

fn model(random: &mut Rng) -> Model {
    let labels = if random.bool() { random.usize(1..40) } else { one_of(random, &[127, 129, 300, 512, 1024]) };
    let min_disparity = match random.u8(..10) {
        0 => 1 << 24,
        1 => -(1 << 24),
        _ => random.i32(-40..60),
    };
    let model = Model::new(one_of(random, &Profile::ALL), labels);
    let model = model.and_then(|model| model.with_min_disparity(min_disparity));
    let strained = random
        .bool()
        .then(|| (random.u8(..), if random.bool() { MAX_TRUNCATION } else { random.u8(..=MAX_TRUNCATION) }));
    let model = model.and_then(|model| match strained {
        Some((slope, truncation)) => model.with_smoothness(slope, truncation),
        None => Ok(model),
    });
    let model = model.unwrap_or_else(|error| panic!("{error}"));
    if random.bool() { model.with_edges(edges(random, model.smoothness())) } else { model }
}

/// Levels of differences up to 120 and more.
fn edges(random: &mut Rng, usual: Smoothness) -> EdgeLevels {
    let mut smoothness = usual;
    let mut most = [0; 3].map(|_| random.u8(..120));
    most.sort_unstable();
    let [first, second, third] = most;
    let levels = [first, second, third, u8::MAX].map(|most| {
        let level = (most, smoothness);
        let Smoothness { slope, truncation } = smoothness;
        smoothness = Smoothness { slope: random.u8(..=slope), truncation: random.u8(..=truncation) };
        level
    });
    EdgeLevels::new(levels).unwrap_or_else(|error| panic!("{error}"))
}

fn settings(random: &mut Rng, width: usize, height: usize) -> Settings {
    let schedule = one_of(random, &Schedule::ALL);
    let is_cut = random.u8(..10) < 3;
    let cut = Cut { x: random.usize(..width), y: random.usize(..height), seed_start: random.bool() };
    let grids = match random.u8(..10) {
        0 => 13,
        1 => MAX_GRIDS,
        _ => random.usize(1..6) as u32,
    };
    let start = one_of(random, &MessageStart::ALL);
    // A sweep has only one message start, and more than three sweeps show nothing new.
    let sweep = schedule == Schedule::Sweep;
    Settings {
        grids: if is_cut { 1 } else { grids },
        steps: random.u32(if sweep { 1..=3 } else { 1..=24 }),
        schedule,
        message_start: if sweep { MessageStart::Receiver } else { start },
        cut: is_cut.then_some(cut),
        coarse_clip: random.bool(),
        label_sets: sweep && random.bool(),
    }
}

fn one_of<T: Copy>(random: &mut Rng, all: &[T]) -> T {
    all[random.usize(..all.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_plan_is_drawn() {
        let plans: Vec<_> = (0..100).map(|seed| random_case(seed).plan).collect();
        let any_model = |is_it: &dyn Fn(&Model) -> bool| plans.iter().any(|plan| is_it(plan.model()));
        let any = |is_it: &dyn Fn(&Settings) -> bool| plans.iter().any(|plan| is_it(plan.settings()));
        let any_size = |is_it: &dyn Fn(Size) -> bool| plans.iter().any(|plan| is_it(plan.image_size()));
        for (profile, schedule) in Profile::ALL.into_iter().flat_map(|p| Schedule::ALL.map(|s| (p, s))) {
            let is_it = |plan: &Plan| (plan.model().profile(), plan.settings().schedule) == (profile, schedule);
            assert!(plans.iter().any(is_it), "{profile:?} {schedule:?}");
        }
        let leveled = |plan: &&Plan| !plan.model().edges().is_uniform();
        assert!(Profile::ALL.iter().all(|&p| plans.iter().filter(leveled).any(|plan| plan.model().profile() == p)));
        assert!(Schedule::ALL.iter().all(|&s| plans.iter().filter(leveled).any(|plan| plan.settings().schedule == s)));
        assert!([127, 129, 300, 512, 1024].iter().all(|&labels| any_model(&|model| model.labels() == labels)));
        assert!([1 << 24, -(1 << 24)].iter().all(|&min| any_model(&|model| model.min_disparity() == min)));
        assert!(any_model(&|model| model.truncation() == MAX_TRUNCATION && model.profile() == Profile::Mrf));
        assert!([1, 2, 3, 4, 5, 13, 25].iter().all(|&grids| any(&|settings| settings.grids == grids)));
        assert!(any(&|settings| settings.message_start == MessageStart::Sender && settings.grids > 1));
        assert!(any(&|settings| settings.coarse_clip && settings.grids > 1));
        assert!(any(&|settings| settings.label_sets && settings.grids > 2));
        assert!([true, false].iter().all(|&seed| any(&|s| s.cut.is_some_and(|cut| cut.seed_start == seed))));
        assert!(plans.iter().any(|plan| plan.margin() > 0 && plan.settings().label_sets));
        assert!(any_size(&|size| size.width == 1100 && size.height > 1));
        assert!(any_size(&|size| size.width < 20 && size.height > 64));
    }

    #[test]
    fn a_seed_always_draws_the_same() {
        let [once, again] = [random_case(7), random_case(7)];
        assert_eq!((once.plan, once.pair.left()), (again.plan, again.pair.left()));
    }
}
