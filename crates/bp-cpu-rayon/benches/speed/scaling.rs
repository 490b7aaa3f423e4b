//! How the time grows with labels and with pixels.

use std::collections::BTreeMap;

use bp_charts::{Axis, Line, Plot, Point, Series, Style, Value};
use bp_core::{Backend, Profile, Size, Stage};
use bp_cpu_rayon::Rayon;

use crate::{
    Bench, Failure,
    machine::available_memory,
    pairs::{Scene, noise},
    report::{Group, Measured, number},
    solve::{Case, Of, Prepared, contestant, hierarchy, milliseconds, ns_per_entry, sweep},
    statistics::{median, range},
    turns::{Contestant, Sample, in_turns, ratio},
};

/// Time of a message entry at several numbers of labels.
pub(crate) fn labels(bench: &Bench) -> Result<Group, Failure> {
    let scene = bench.data.baby1()?;
    let size = scene.pair.size();
    let name = |labels| format!("{labels} labels");
    let entrant = |labels| {
        let case = Case { scene: &scene, profile: Profile::Census, labels, settings: hierarchy(size, 1, 10) };
        let prepared = Prepared::new(bench.pool(1), (&Rayon, 0), &case)?;
        Ok::<_, Failure>(contestant(name(labels), Of::Updates, bench.rounds(15), [None; 2], prepared))
    };
    const LABELS: [usize; 6] = [2, 16, 64, 128, 300, 512];
    let measured = in_turns(LABELS.into_iter().map(entrant).collect::<Result<_, _>>()?)?;
    let compare = |labels, asked| ratio(&measured, &name(labels), &name(128), asked);
    let within = Some("at most 1.5");
    let ratios = [compare(2, None), compare(16, within), compare(300, within), compare(512, None)];
    let point =
        |(labels, m): (usize, &Measured)| Point::new(labels as f64, Value { value: m.median, low: m.min, high: m.max });
    let points = LABELS.into_iter().zip(&measured).map(point).collect();
    let title = format!("Time of a message entry: {}x{}, census, 1 thread", size.width, size.height);
    let chart = Plot {
        description: "Median, least and greatest time over rounds at each number of labels.".to_owned(),
        x: Axis { ticks: LABELS.map(|labels| labels as f64).into(), ..Axis::logarithmic("labels") },
        y: Axis::linear("nanoseconds per message entry"),
        levels: vec![],
        keys: vec![],
        series: vec![Series {
            name: "update_messages".into(),
            style: Style::numbered(0).with_line(Line::Solid),
            points,
        }],
        title,
    };
    let title = format!("Message update of {}, census, 1 grid, 10 checkerboard half-steps, 1 thread.", scene.name);
    let note = "At few labels all of it fits the last cache; at many it does not.".to_owned();
    let (ratios, charts) = (ratios.into_iter().flatten().collect(), vec![("labels".to_owned(), chart)]);
    Ok(Group { name: "labels", title, notes: vec![note], measured, ratios, charts, ..Group::default() })
}

/// Labels of [`pixels`].
const LABELS: usize = 64;

/// What is run on images of growing size.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Run {
    Sweep,
    Update,
}

impl Run {
    const ALL: [Self; 2] = [Self::Sweep, Self::Update];

    fn named(self, megapixels: f64) -> String {
        let what = match self {
            Self::Sweep => "sweep",
            Self::Update => "update",
        };
        format!("{what}, {megapixels} MP")
    }

    fn case(self, scene: &Scene) -> Case<'_> {
        let size = scene.pair.size();
        let settings = match self {
            Self::Sweep => sweep(size),
            Self::Update => hierarchy(size, 1, 10),
        };
        Case { scene, profile: Profile::Census, labels: LABELS, settings }
    }
}

/// Whole sweeps and message updates over images of 0.1 to 30 megapixels.
pub(crate) fn pixels(bench: &Bench) -> Result<Group, Failure> {
    let sizes: &[f64] = if bench.quick { &[0.1, 0.3, 1.0] } else { &[0.1, 0.3, 1.0, 3.0, 10.0, 30.0] };
    let scenes = sizes.iter().map(|&megapixels| Ok((megapixels, scene(megapixels)?)));
    let scenes = scenes.collect::<Result<Vec<_>, Failure>>()?;
    let mut notes = vec![
        "The pairs are noise. Every round prepares each size anew and solves it twice; the second time counts."
            .to_owned(),
    ];
    let mut contestants = vec![];
    for (megapixels, scene) in &scenes {
        for run in Run::ALL {
            match refused(bench, &run.case(scene))? {
                Some(why) => notes.push(format!("{} is left out: {why}.", run.named(*megapixels))),
                None => contestants.push(entrant(bench, run, *megapixels, scene)?),
            }
        }
    }
    let measured = in_turns(contestants)?;
    let largest = |run: Run| sizes.iter().rev().map(|&m| run.named(m)).find(|n| measured.iter().any(|m| m.name == *n));
    let compare = |run: Run| ratio(&measured, &largest(run)?, &run.named(sizes[0]), None);
    let ratios = Run::ALL.into_iter().filter_map(compare).collect();
    let charts = vec![("pixels".to_owned(), chart(&measured))];
    let title = format!(
        "Time against pixels: images of 4:3, {LABELS} labels, census, 2 threads; whole matches by sweep, and message \
         updates of 1 grid, 10 checkerboard half-steps."
    );
    Ok(Group { name: "pixels", title, notes, measured, ratios, charts, ..Group::default() })
}

/// Noise of so many megapixels, 4:3.
fn scene(megapixels: f64) -> Result<Scene, Failure> {
    let width = (megapixels * 1e6 * 4.0 / 3.0).sqrt().round();
    let size = Size { width: width as usize, height: (0.75 * width).round() as usize };
    Ok(Scene { name: format!("noise of {megapixels} MP"), pair: noise(size, LABELS / 3)?, truth: None })
}

/// Why a case cannot be run, if so: it may take 80 % of the memory that is free.
fn refused(bench: &Bench, case: &Case<'_>) -> Result<Option<String>, Failure> {
    let plan = case.plan()?;
    let needed = bench.pool(2).install(|| Ok::<_, bp_core::Error>(Rayon.open(0)?.planned_bytes(&plan)))?;
    let enough = |available: u64| needed as f64 <= 0.8 * available as f64;
    let gigabytes = |bytes: u64| number(bytes as f64 / 1e9);
    let why = |available| format!("it needs {} GB, and {} are free", gigabytes(needed), gigabytes(available));
    Ok(available_memory().filter(|&available| !enough(available)).map(why))
}

fn entrant<'a>(bench: &'a Bench, run: Run, megapixels: f64, scene: &'a Scene) -> Result<Contestant<'a>, Failure> {
    let plan = run.case(scene).plan()?;
    let pixels = scene.pair.size().pixels() as f64;
    let measure = move || {
        let times = Prepared::new(bench.pool(2), (&Rayon, 0), &run.case(scene))?.solve()?;
        let value = match run {
            Run::Sweep => milliseconds(times.total) * 1e6 / pixels,
            Run::Update => ns_per_entry(&times, &plan),
        };
        Ok(Sample { value, stages_ms: Some(times.wall.map(milliseconds)) })
    };
    Ok(Contestant {
        name: run.named(megapixels),
        unit: run.unit(),
        rounds: bench.rounds(if megapixels > 5.0 { 3 } else { 9 }),
        asked: [None; 2],
        facts: BTreeMap::from([(MEGAPIXELS, pixels / 1e6)]),
        run: Box::new(measure),
    })
}

const MEGAPIXELS: &str = "megapixels";

/// Milliseconds against pixels, and lines of what would be proportional to pixels.
fn chart(measured: &[Measured]) -> Plot {
    let mut ticks: Vec<f64> = measured.iter().map(|m| (10.0 * m.facts[MEGAPIXELS]).round() / 10.0).collect();
    ticks.sort_by(f64::total_cmp);
    ticks.dedup();
    Plot {
        title: format!("Time against pixels: {LABELS} labels, census, 2 threads"),
        description: "Median, least and greatest time over rounds at each size.".to_owned(),
        x: Axis { ticks, ..Axis::logarithmic("megapixels") },
        y: Axis::logarithmic("milliseconds"),
        levels: vec![],
        keys: vec![],
        series: Run::ALL.into_iter().filter_map(|run| run.series(measured)).flatten().collect(),
    }
}

impl Run {
    /// Its times, and a line through the one next to 1 megapixel.
    fn series(self, measured: &[Measured]) -> Option<[Series<Point>; 2]> {
        let (names, number) = match self {
            Self::Sweep => (["sweep, whole match", "proportional to pixels (sweep)"], 0),
            Self::Update => (["message updates, 10 half-steps", "proportional to pixels (updates)"], 1),
        };
        let own = measured.iter().filter(|m| m.unit == self.unit());
        let points: Vec<Point> = own.map(|m| self.point(m)).collect();
        let from_one = |point: &Point| point.x.value.ln().abs();
        let next = points.iter().copied().min_by(|a, b| from_one(a).total_cmp(&from_one(b)))?;
        let slope = next.y.value / next.x.value;
        let line = points.iter().map(|point| Point::new(point.x, slope * point.x.value)).collect();
        let [name, proportional] = names.map(str::to_owned);
        Some([
            Series { name, style: Style::numbered(number), points },
            Series { name: proportional, style: Style::line(number, Line::Dashes), points: line },
        ])
    }

    /// Megapixels and milliseconds.
    fn point(self, measured: &Measured) -> Point {
        let megapixels = measured.facts[MEGAPIXELS];
        let times: Vec<f64> = match self {
            Self::Sweep => measured.samples.iter().map(|sample| sample * megapixels).collect(),
            Self::Update => measured.stages_ms.iter().map(|stages| stages[Stage::UpdateMessages as usize]).collect(),
        };
        let [low, high] = range(&times);
        Point::new(megapixels, Value { value: median(&times), low, high })
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Sweep => "ms per megapixel",
            Self::Update => "ns per message entry",
        }
    }
}
