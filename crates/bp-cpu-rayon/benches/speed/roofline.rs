//! What this machine allows, measured in the same rounds as the stages that are set beside it.

use std::{cell::RefCell, collections::BTreeMap};

use bp_charts::{Axis, BLACK, Line, Plot, Point, Series, Style};
use bp_core::{Backend, Error, Plan, Profile, Stage};
use bp_cpu_rayon::Rayon;

use crate::{
    Bench, Failure, THREADS,
    kernels::{Access, arithmetic, bandwidth},
    machine::caches,
    report::{Group, Limit, Measured, Ratio},
    solve::{Case, Of, Prepared, contestant, hierarchy, threads},
    statistics::median,
    turns::{Contestant, Sample, in_turns, ratio},
};

/// The case of five grids.
const HIERARCHY: &str = "5 x 10";

/// Bytes of the buffer in main memory.
const LARGE: usize = 256 << 20;

/// Bytes that a pass over the small buffer repeats to.
const REPEATED: usize = 4 << 30;

/// Steps of the chains of operations.
const ITERATIONS: usize = 2_000_000;

/// The stages that a limit is computed of; the rayon backend refines while it updates messages.
const STAGES: [Stage; 4] = [Stage::MatchCost, Stage::Coarsen, Stage::UpdateMessages, Stage::SelectLabels];

/// Bandwidths, arithmetic, and the stages of two plans beside them.
pub(crate) fn roofline(bench: &Bench) -> Result<Group, Failure> {
    let scene = bench.data.baby1()?;
    let size = scene.pair.size();
    let case = |settings| Case { scene: &scene, profile: Profile::Census, labels: 128, settings };
    let cases = [(HIERARCHY, case(hierarchy(size, 5, 10))), ("1 x 10", case(hierarchy(size, 1, 10)))];
    let rounds = bench.rounds(9);
    let buffer = RefCell::new(vec![1; LARGE]);
    let mut contestants = vec![];
    for count in THREADS {
        contestants.extend(machine(bench, count, rounds, &buffer));
        for (name, case) in &cases {
            let prepared = Prepared::new(bench.pool(count), (&Rayon, 0), case)?;
            contestants.push(contestant(named(name, count), Of::Total, rounds, [None; 2], prepared));
        }
    }
    let measured = in_turns(contestants)?;
    let limits = limits(bench, &measured, &cases)?;
    let chart = |count| {
        let title = format!("Roofline: {}, 128 labels, census, {}", scene.described(), threads(count));
        (format!("roofline-{count}"), chart(title, &Roofs::of(&measured, count), &limits, count))
    };
    let charts = THREADS.map(chart).into();
    let title = format!(
        "Stages beside the limits of this machine: {}, 128 labels, census; 5 grids and 1 grid x 10 half-steps.",
        scene.described()
    );
    let ratios = speed_ups(&measured);
    let notes = NOTES.map(|note| note.split_whitespace().collect::<Vec<_>>().join(" ")).into();
    Ok(Group { name: "roofline", title, notes, measured, ratios, limits, charts })
}

/// How much more of the machine two threads use than one.
fn speed_ups(measured: &[Measured]) -> Vec<Ratio> {
    let limits = measured.iter().filter(|m| m.stages_ms.is_empty());
    let names = limits.filter_map(|m| m.name.strip_suffix(", 1 thread"));
    names.filter_map(|name| ratio(measured, &named(name, 2), &named(name, 1), None)).collect()
}

/// All stages of all cases beside what the machine allows.
fn limits(bench: &Bench, measured: &[Measured], cases: &[(&str, Case<'_>)]) -> Result<Vec<Limit>, Failure> {
    let mut limits = vec![];
    for count in THREADS {
        let roofs = Roofs::of(measured, count);
        for (name, case) in cases {
            let work = works(&case.plan()?, fused_steps(bench, case)?);
            limits.extend(work.into_iter().filter_map(|work| limit(measured, (name, count), &roofs, &work)));
        }
    }
    Ok(limits)
}

const NOTES: [&str; 4] = [
    "Bytes moved are the least that must pass between main memory and caches if nothing stays in a cache from one stage
     to the next, from one grid to the next, or between runs of fused half-steps. Some does stay: a fraction above
     100 % says so.",
    "The memory limit is what is only read by the read bandwidth, what is only written by the write bandwidth, and what
     is read and written by that in place, in main memory. Operations count once a byte, loads and stores not at all.",
    "Bandwidths of memory are over one buffer of 256 MiB, those of the third cache over a quarter of it, those of the
     second cache over half of it for each thread.",
    "Third cache: the time of message updates if every half-step had all its rows from there and put them back, and did
     nothing else.",
];

fn named(case: &str, count: usize) -> String {
    format!("{case}, {}", threads(count))
}

/// How many half-steps the solver makes in one pass over the image.
fn fused_steps(bench: &Bench, case: &Case<'_>) -> Result<u32, Failure> {
    let plan = case.plan()?;
    Ok(bench.pool(1).install(|| Ok::<_, Error>(Rayon.open(0)?.prepare(&plan)?.fused_steps()))?)
}

/// Contestants that measure the machine with so many threads.
fn machine<'a>(bench: &'a Bench, count: usize, rounds: usize, buffer: &'a RefCell<Vec<u8>>) -> Vec<Contestant<'a>> {
    let pool = bench.pool(count);
    let [second, third] = caches();
    let (second, third) = (count * second / 2, third / 4);
    let contestant = |name: String, unit, run: Box<dyn Fn() -> f64 + 'a>| Contestant {
        name: named(&name, count),
        unit,
        rounds,
        asked: [None; 2],
        facts: BTreeMap::new(),
        run: Box::new(move || Ok(Sample { value: run(), stages_ms: None })),
    };
    let mut contestants = vec![];
    let places = [("memory", LARGE), ("third cache", third), ("second cache", second)];
    for (place, bytes) in places {
        let repeats = if bytes == LARGE { 1 } else { REPEATED / bytes };
        for access in Access::ALL {
            let run = move || bandwidth(pool, access, &mut buffer.borrow_mut()[..bytes], repeats);
            contestants.push(contestant(format!("{place}, {}", access.name()), "GB/s", Box::new(run)));
        }
    }
    let run = move || arithmetic(pool, ITERATIONS);
    contestants.push(contestant(ARITHMETIC.to_owned(), "10^9 operations/s", Box::new(run)));
    contestants
}

const ARITHMETIC: &str = "u8 add and min";

/// The limits measured with some number of threads, in bytes and operations a second.
struct Roofs {
    /// By [`Access::ALL`].
    memory: [f64; 3],
    third_cache: [f64; 3],
    arithmetic: f64,
}

impl Roofs {
    fn of(measured: &[Measured], count: usize) -> Self {
        let value = |name: &str| {
            let found = measured.iter().find(|m| m.name == named(name, count));
            found.map_or(f64::NAN, |m| 1e9 * m.median)
        };
        let bandwidths = |place: &str| Access::ALL.map(|access| value(&format!("{place}, {}", access.name())));
        let (memory, third_cache) = (bandwidths("memory"), bandwidths("third cache"));
        Self { memory, third_cache, arithmetic: value(ARITHMETIC) }
    }
}

/// What a stage has to do.
struct Work {
    stage: Stage,
    /// Bytes that are only read, only written, and read and written, each way counted: by [`Access::ALL`].
    bytes: [f64; 3],
    /// Operations on a byte each.
    operations: f64,
    /// Message entries updated.
    updates: f64,
}

/// The work of each stage. V, or `volume(grid)`, are nodes times labels: bytes of a grid's data costs, and of one of
/// the two messages that a node has for the edges to its right and below. All images but the volumes are small change.
fn works(plan: &Plan, fused_steps: u32) -> Vec<Work> {
    let volume = |grid| plan.volume(grid) as f64;
    // Costs as a coarser grid sums them: kept sums, else the stored ones.
    let sum_bytes = |grid| if plan.keeps_sums(grid) { plan.sum_bytes(grid) as f64 } else { 0.0 };
    let written = |grid| volume(grid) * (1.0 + sum_bytes(grid));
    let mut coarsen = Work { stage: Stage::Coarsen, bytes: [0.0; 3], operations: 0.0, updates: 0.0 };
    for grid in 1..plan.grids() {
        coarsen.bytes[0] += volume(grid - 1) * sum_bytes(grid - 1).max(1.0);
        coarsen.bytes[1] += written(grid);
        // Three additions, the node's least, taking it off and clipping; an operation on two bytes counts twice.
        coarsen.operations += 6.0 * volume(grid) * plan.sum_bytes(grid) as f64;
    }
    let stages = [
        // Written once. Per entry: compare, count bits, clip, mask twice, the node's least, take it off, clip.
        Work { stage: Stage::MatchCost, bytes: [0.0, written(0), 0.0], operations: 8.0 * volume(0), updates: 0.0 },
        coarsen,
        update(plan, fused_steps),
        // Reads costs, and one message an edge, 2 V, of both colours' sets. Per entry: four additions, compare, choose,
        // least.
        Work {
            stage: Stage::SelectLabels,
            bytes: [5.0 * volume(0), 0.0, 0.0],
            operations: 7.0 * volume(0),
            updates: 0.0,
        },
    ];
    stages.into_iter().filter(|work| work.operations > 0.0 && STAGES.contains(&work.stage)).collect()
}

/// Checkerboard half-steps of all grids, so many in one pass. One message an edge is updated in place: 2 V.
fn update(plan: &Plan, fused_steps: u32) -> Work {
    let volume = |grid| plan.volume(grid) as f64;
    let passes = f64::from(plan.settings().steps.div_ceil(fused_steps));
    let (mut read, mut written, mut in_place) = (0.0, 0.0, 0.0);
    for grid in 0..plan.grids() {
        // Costs in every pass; in the first, what the coarser grid's nodes of either colour received, 2 V a colour.
        read += passes * volume(grid) + if grid + 1 < plan.grids() { 4.0 * volume(grid + 1) } else { 0.0 };
        // The first pass starts with zeros or with the coarser grid's messages, so that it need not read these; the
        // last half-step writes to a second set.
        written += 2.0 * volume(grid) + 2.0 * volume(grid);
        in_place += (passes - 1.0) * 4.0 * volume(grid);
    }
    // Per entry: two additions of what is received, of which four messages share some; in the pass up the labels add,
    // two minima; in the pass down add, minimum, subtract, minimum.
    Work {
        stage: Stage::UpdateMessages,
        bytes: [read, written, in_place],
        operations: 9.0 * plan.message_updates() as f64,
        updates: plan.message_updates() as f64,
    }
}

/// A stage's work beside its time.
fn limit(measured: &[Measured], (case, threads): (&str, usize), roofs: &Roofs, work: &Work) -> Option<Limit> {
    let solves = measured.iter().find(|m| m.name == named(case, threads))?;
    let times: Vec<f64> = solves.stages_ms.iter().map(|stages| stages[work.stage as usize]).collect();
    let memory: f64 = work.bytes.iter().zip(roofs.memory).map(|(bytes, roof)| bytes / roof).sum();
    Some(Limit {
        case: case.to_owned(),
        threads,
        stage: work.stage.name(),
        ms: median(&times),
        bytes: work.bytes.iter().sum(),
        operations: work.operations,
        memory_ms: 1e3 * memory,
        arithmetic_ms: 1e3 * work.operations / roofs.arithmetic,
        third_cache_ms: (work.updates > 0.0).then(|| {
            // Every half-step reads each message, writes another in its place, and reads a cost for four of them.
            1e3 * work.updates * (2.0 / roofs.third_cache[2] + 0.25 / roofs.third_cache[0])
        }),
    })
}

/// Operations a second against operations a byte: roofs as lines, stages as points.
fn chart(title: String, roofs: &Roofs, limits: &[Limit], count: usize) -> Plot {
    // Of a single grid, the other stages do the same work.
    let shown = |limit: &&Limit| limit.case == HIERARCHY || limit.stage == Stage::UpdateMessages.name();
    let own = || limits.iter().filter(|limit| limit.threads == count).filter(shown);
    let reach = own().map(|limit| limit.operations / limit.bytes);
    let (low, high) = reach.fold((1.0, 100.0), |(low, high): (f64, f64), x| (low.min(0.7 * x), high.max(1.4 * x)));
    let roof = |name: &str, bandwidth: f64, line| {
        let point = |x: f64| Point::new(x, (x * bandwidth).min(roofs.arithmetic) / 1e9);
        let points = [low, (roofs.arithmetic / bandwidth).clamp(low, high), high].map(point);
        Series { name: name.to_owned(), style: Style::line(BLACK, line), points: points.into() }
    };
    let point = |(number, limit): (usize, &Limit)| {
        let [x, y] = [limit.operations / limit.bytes, limit.operations / limit.ms / 1e6];
        let name = format!("{}: {}", limit.case, limit.stage);
        // Black is for the roofs.
        let style = Style::numbered(number + usize::from(number >= BLACK));
        Series { name, style, points: vec![Point::new(x, y)] }
    };
    let roofs = [
        roof("reading from memory; arithmetic", roofs.memory[0], Line::Solid),
        roof("in place in memory; arithmetic", roofs.memory[2], Line::Dashes),
        roof("in place in the third cache; arithmetic", roofs.third_cache[2], Line::Dots),
    ];
    Plot {
        title,
        description: "What memory and arithmetic allow, and what each stage reaches.".to_owned(),
        x: Axis::logarithmic("operations on a byte per byte moved"),
        y: Axis::logarithmic("10^9 operations on a byte per second"),
        levels: vec![],
        keys: vec![],
        series: own().enumerate().map(point).chain(roofs).collect(),
    }
}
