//! The cases that backends are compared on.

use bp_core::{
    Algorithm, Cut, EdgeLevels, Error, MessageStart, Model, Node, Profile, Schedule, Settings, Size, Smoothness,
    StereoPair,
};

use crate::{Case, noise_pair, stepped_pair};

/// All cases. They cover every algorithm, profile, schedule and message start at tiny, odd and prime sizes, with few
/// and many labels, with edges of several levels, and with the smoothness that strains 8 bits most. Strips of a higher image with
/// every kind of apron follow.
pub fn cases() -> impl Iterator<Item = Case> {
    let sizes = [(1, 1), (1, 5), (7, 1), (2, 3), (5, 4), (13, 11), (17, 8)];
    let small = sizes.into_iter().flat_map(|size| [1, 2, 3, 16].map(|labels| (size, labels)));
    let many_labels = [64, 112, 256, 300].map(|labels| ((5, 3), labels));
    let every = small
        .chain(many_labels)
        .flat_map(|(size, labels)| models(labels).into_iter().map(move |model| (size, model)).collect::<Vec<_>>());
    // Some are wide enough for several tiles of the widest vectors; the rows of one fill its vectors exactly. Others are high
    // enough for several bands, on coarser grids too, and their last band is short. The oracle is slow, so these sizes get
    // fewer models.
    let wide_or_high = [(131, 35), (256, 3), (9, 99), (6, 70), (3, 65), (2, 130)];
    let large = wide_or_high.into_iter().flat_map(|size| {
        let plain = Profile::ALL.into_iter().filter_map(|profile| Model::new(profile, 5).ok());
        let weak = Model::new(Profile::Census, 5).map(|model| model.with_edges_halved_above(25));
        plain.chain(weak).map(move |model| (size, model))
    });
    let whole = every.chain(large).flat_map(|((width, height), model)| {
        let pair = noise_pair(width, height, model.labels() as u64);
        settings(pair.size()).into_iter().filter_map(move |settings| case(&pair, model, settings))
    });
    whole.chain(strips()).chain(label_sets()).chain(margins())
}

/// Cases of [`Schedule::Outward`]: start nodes at corners, borders and inside, whole images and parts.
pub(crate) fn outward_cases() -> impl Iterator<Item = Case> {
    let sizes = [(1, 1), (1, 5), (7, 1), (2, 3), (13, 11), (35, 6), (9, 40)];
    let problems = sizes.into_iter().flat_map(|size| [1, 2, 16, 70].map(|labels| (size, labels)));
    let models = problems.flat_map(|(size, labels)| models(labels).into_iter().map(move |model| (size, model)));
    models.flat_map(|((width, height), model)| {
        let pair = noise_pair(width, height, model.labels() as u64);
        let starts = [(0, 0), (width / 2, height / 2), (width - 1, 0), (width / 3, height - 1)];
        let cut = Cut { x: 2 * width / 3, y: height / 3, seed_start: false };
        let settings = starts.into_iter().flat_map(move |(x, y)| {
            let schedule = Schedule::Outward { start: Node { x, y } };
            let of = |algorithm: Algorithm| algorithm.settings(Size { width, height }, 3, 1, schedule);
            let parts = of(Algorithm::Ctbp);
            [of(Algorithm::Bp), parts, Settings { cut: Some(cut), ..parts }]
        });
        settings.map(move |settings| Case::new(pair.clone(), model, settings).unwrap_or_else(|error| panic!("{error}")))
    })
}

/// Plans with label sets on two or three grids: of pictures whose sets differ between patches, bands and seams, and of noise,
/// where messages at the borders matter.
fn label_sets() -> impl Iterator<Item = Case> {
    let noise = [(10, 8), (13, 2), (14, 7), (17, 6), (67, 5)].into_iter().flat_map(|(width, height)| {
        let pair = noise_pair(width, height, width as u64);
        let model = |profile| Model::new(profile, 40)?.with_min_disparity(3);
        [Profile::Census, Profile::Mrf].into_iter().filter_map(move |profile| {
            let settings = Algorithm::Sweep.settings(pair.size(), 1, 1, Schedule::Sweep);
            case(&pair, model(profile).ok()?, Settings { grids: 3, label_sets: true, ..settings })
        })
    });
    stepped_label_sets().chain(noise)
}

fn stepped_label_sets() -> impl Iterator<Item = Case> {
    let plain = |profile, labels| Model::new(profile, labels);
    let weak = |profile, slope, truncation| {
        Ok(plain(profile, 30)?.with_smoothness(slope, truncation)?.with_edges_halved_above(30))
    };
    let steep =
        steep_levels().ok_or(Error::EdgeLevels).and_then(|edges| Ok(plain(Profile::Mrf, 30)?.with_edges(edges)));
    let models = [
        ((131, 70), plain(Profile::Census, 40)),
        ((131, 40), plain(Profile::Census16, 34)),
        ((70, 40), plain(Profile::Census32, 34)),
        ((140, 20), steep),
        ((65, 135), weak(Profile::Census, 4, 15)),
        ((200, 40), plain(Profile::Gradient, 33)),
        ((135, 9), weak(Profile::Mrf, 3, 63)),
        ((40, 135), plain(Profile::Census, 450)),
    ];
    models.into_iter().filter_map(|(size, model)| Some((size, model.ok()?))).flat_map(|((width, height), model)| {
        let pair = stepped_pair(width, height, model.labels());
        let ours = Algorithm::Sweep.settings(pair.size(), 1, 1, Schedule::Sweep);
        let settings = [(3, 1, true), (4, 2, false)];
        settings.into_iter().filter_map(move |(grids, steps, coarse_clip)| {
            case(&pair, model, Settings { grids, steps, coarse_clip, label_sets: true, ..ours })
        })
    })
}

/// Nodes that do not cover the first columns of a pair: of every profile, with edges of several levels, a seed and label sets.
fn margins() -> impl Iterator<Item = Case> {
    [1, 6, 67].into_iter().flat_map(|margin| {
        let noise = noise_pair(margin + 37, 9, margin as u64);
        let profiles = Profile::ALL.into_iter().flat_map(move |profile| {
            let size = Size { width: 37, height: 9 };
            let ways = [
                Algorithm::Sweep.settings(size, 1, 1, Schedule::Sweep),
                Algorithm::Cfbp.settings(size, 7, 2, Schedule::Checkerboard),
                Algorithm::Ctbp.settings(size, 4, 1, Schedule::Sync),
            ];
            let model = Model::new(profile, 12).map(|model| model.with_edges_halved_above(20)).ok();
            let noise = noise.clone();
            ways.into_iter().filter_map(move |settings| case(&noise, model?, settings)?.behind(margin).ok())
        });
        let stepped = stepped_label_sets().step_by(3).filter_map(move |case| case.behind(margin).ok());
        profiles.chain(stepped)
    })
}

/// Strips of one pair with no, one or several known rows above and below, for each profile.
fn strips() -> impl Iterator<Item = Case> {
    let pair = noise_pair(19, 9, 8);
    let rows = [0..1, 0..7, 1..8, 2..9, 4..5];
    let strips = rows.map(|rows| pair.strip(rows)).into_iter();
    strips.flat_map(|strip| Profile::ALL.map(|profile| (strip.clone(), profile))).flat_map(|(strip, profile)| {
        let settings = Schedule::ALL.map(|schedule| Algorithm::Cfbp.settings(strip.size(), 7, 2, schedule));
        let model = Model::new(profile, 6).map(|model| model.with_edges_halved_above(20)).ok();
        settings.into_iter().filter_map(move |settings| case(&strip, model?, settings))
    })
}

fn case(pair: &StereoPair, model: Model, settings: Settings) -> Option<Case> {
    Case::new(pair.clone(), model, settings).ok()
}

fn models(labels: usize) -> Vec<Model> {
    let of = |profile| Model::new(profile, labels).into_iter();
    let strained = [(1, 63), (63, 63), (255, 63), (0, 5), (3, 0)];
    let plain = Profile::ALL.into_iter().flat_map(of);
    let strained = strained.into_iter().flat_map(move |(slope, truncation)| {
        of(Profile::Mrf).filter_map(move |model| model.with_smoothness(slope, truncation).ok())
    });
    let weak = [(Profile::Census, 2, 10, 30), (Profile::Mrf, 3, 63, 10), (Profile::Mrf, 255, 63, 60)];
    let weak = weak.into_iter().flat_map(move |(profile, slope, truncation, threshold)| {
        of(profile)
            .filter_map(move |model| model.with_smoothness(slope, truncation).ok())
            .map(move |model| model.with_edges_halved_above(threshold))
    });
    let levels = [steep_levels(), flat_levels()].into_iter().flatten();
    let levels = levels.flat_map(move |edges| of(Profile::Mrf).map(move |model| model.with_edges(edges)));
    let negative = of(Profile::Census).filter_map(|model| model.with_min_disparity(-2).ok());
    plain.chain(strained).chain(weak).chain(levels).chain(negative).collect()
}

/// Four levels, the first of which strains 8 bits most.
fn steep_levels() -> Option<EdgeLevels> {
    let of = |slope, truncation| Smoothness { slope, truncation };
    EdgeLevels::new([(20, of(255, 63)), (40, of(63, 63)), (90, of(5, 63)), (255, of(1, 20))]).ok()
}

/// Four levels, of which one has no slope and one no cost at all; one is never reached.
fn flat_levels() -> Option<EdgeLevels> {
    let of = |slope, truncation| Smoothness { slope, truncation };
    EdgeLevels::new([(30, of(9, 40)), (60, of(0, 40)), (60, of(0, 9)), (255, of(0, 0))]).ok()
}

fn settings(size: Size) -> Vec<Settings> {
    let mut all = Vec::new();
    for schedule in Schedule::ALL {
        all.extend(Algorithm::THESIS.map(|algorithm| algorithm.settings(size, 7, 2, schedule)));
        let cut = Cut { x: size.width / 3, y: 2 * size.height / 3, seed_start: false };
        all.push(Settings { cut: Some(cut), ..Algorithm::Ctbp.settings(size, 4, 1, schedule) });
        let hierarchy = Algorithm::Cfbp.settings(size, 7, 1, schedule);
        all.extend(MessageStart::ALL.map(|message_start| Settings { grids: 3, steps: 3, message_start, ..hierarchy }));
        all.push(Settings { grids: 3, steps: 2, coarse_clip: true, ..hierarchy });
    }
    all.extend(sweeps(size));
    all
}

/// Settings for the schedule `sweep`: one and two loops, one and several grids, clipped and not, with label sets and
/// without, cuts on and beside a seam.
fn sweeps(size: Size) -> impl Iterator<Item = Settings> {
    let ours = Algorithm::Sweep.settings(size, 1, 1, Schedule::Sweep);
    let grids = [(1, 1), (1, 2), (2, 1), (3, 2)].map(|(grids, steps)| Settings { grids, steps, ..ours });
    let restricted =
        [(3, 1), (3, 2), (4, 1), (5, 3)].map(|(grids, steps)| Settings { grids, steps, label_sets: true, ..ours });
    let unclipped = grids.map(|settings| Settings { coarse_clip: false, ..settings });
    let cuts =
        [(0, 1), (20, 1), (26, 2), (31, 1), (31, 2), (32, 1), (32, 2), (33, 1), (33, 2), (36, 1)].map(|(y, steps)| {
            let cut = Cut { x: size.width / 2, y, seed_start: false };
            Settings { cut: Some(cut), grids: 1, steps, ..ours }
        });
    std::iter::once(ours).chain(grids).chain(unclipped).chain(restricted).chain(cuts)
}
