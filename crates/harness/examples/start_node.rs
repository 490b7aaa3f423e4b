//! What a start node changes: the energy and the errors of BP after each loop, in six orders of passing messages.
//!
//! `cargo run --release -p harness --example start_node -- DATA FOLDER` measures the thesis's six scenes on the reference
//! backend (half an hour of one core) and writes `energies.json`, `start-node.md` and `start-node.svg` to FOLDER.
//! `-- --from FOLDER` writes the last two again.

use std::{error::Error, fmt::Write as _, fs, path::Path};

use bp_charts::{Axis, Line, Plot, Point, Series, Style};
use bp_core::{
    Algorithm, Backend, DisparityMap, Energy, Model, Node, Plan, Profile, Schedule, Settings, Size, census, never,
};
use bp_cpu_scalar::Scalar;
use harness::{
    machine,
    record::{Machine, Program},
    scenes::{Scene, Source},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

type Result<T> = std::result::Result<T, Box<dyn Error + Send + Sync>>;

/// Loops of a run: as many as labels, as in the thesis.
const LOOPS: u32 = 112;

/// The loops whose results the table shows.
const SHOWN: [usize; 6] = [1, 2, 5, 10, 25, 112];

/// The orders of passing messages.
const ORDERS: [&str; 6] = [
    "all at once (`sync`)",
    "alternating (`checkerboard`)",
    "outward from (0, 0)",
    "outward from the centre",
    "four parts, all at once: CTBP",
    "four parts, outward from the centre",
];

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    program: Program,
    machine: Machine,
    labels: usize,
    runs: Vec<Run>,
}

/// One order on one scene. The lists have an entry for each loop.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Run {
    order: String,
    scene: String,
    /// The energy of profile `thesis` over all edges, those across the cut included.
    energies: Vec<u64>,
    /// Percentage of non-occluded pixels that are wrong by more than 1 px.
    bad: Vec<f64>,
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [first, folder] = arguments.as_slice() else { return Err("usage: start_node DATA FOLDER".into()) };
    let folder = Path::new(folder);
    let file = folder.join("energies.json");
    if first != "--from" {
        fs::create_dir_all(folder)?;
        fs::write(&file, serde_json::to_string_pretty(&measured(Path::new(first))?)? + "\n")?;
    }
    let record: Record = serde_json::from_str(&fs::read_to_string(file)?)?;
    fs::write(folder.join("start-node.md"), page(&record)?)?;
    fs::write(folder.join("start-node.svg"), chart(&record).svg()?)?;
    Ok(())
}

fn measured(data: &Path) -> Result<Record> {
    let source = Source::new(Some(data.to_owned()), false)?;
    let scenes =
        (0..source.names().len()).map(|index| source.load(index)).collect::<std::result::Result<Vec<_>, _>>()?;
    let labels = source.set.labels;
    let pairs: Vec<_> = ORDERS.iter().flat_map(|order| scenes.iter().map(move |scene| (*order, scene))).collect();
    let runs = pairs.par_iter().map(|(order, scene)| run(order, scene, labels)).collect::<Result<_>>()?;
    Ok(Record { program: machine::program()?, machine: machine::machine(None), labels, runs })
}

fn settings(order: &str, size: Size) -> Settings {
    let centre = Schedule::Outward { start: Node { x: size.width / 2, y: size.height / 2 } };
    let of = |algorithm: Algorithm, schedule| algorithm.settings(size, LOOPS, 1, schedule);
    match ORDERS.iter().position(|known| *known == order) {
        Some(1) => of(Algorithm::Bp, Schedule::Checkerboard),
        Some(2) => of(Algorithm::Bp, Schedule::Outward { start: Node { x: 0, y: 0 } }),
        Some(3) => of(Algorithm::Bp, centre),
        Some(4) => of(Algorithm::Ctbp, Schedule::Sync),
        Some(5) => of(Algorithm::Ctbp, centre),
        _ => of(Algorithm::Bp, Schedule::Sync),
    }
}

/// Runs one order on one scene, and reads the labels after each loop.
fn run(order: &str, scene: &Scene, labels: usize) -> Result<Run> {
    let pair = &scene.pair;
    let plan = Plan::new(pair.size(), Model::new(Profile::Thesis, labels)?, settings(order, pair.size()))?;
    let mut solver = Scalar.open(0)?.prepare(&plan, &never)?;
    solver.match_cost(pair, census::seed(pair, &plan))?;
    solver.refine(0)?;
    let mut found = Run { order: order.to_owned(), scene: scene.record.name.clone(), energies: vec![], bad: vec![] };
    let mut answer = vec![0; pair.size().pixels()];
    for steps in (0..plan.settings().steps).step_by(plan.settings().schedule.steps_per_loop() as usize) {
        solver.update_messages(0, steps..steps + plan.settings().schedule.steps_per_loop())?;
        solver.select_labels(0, &mut answer)?;
        let errors = scene.truth.errors(&DisparityMap::from_labels(pair.size(), plan.model(), &answer)?)?;
        found.energies.push(Energy::of(pair, plan.model(), &answer)?.total());
        found.bad.push(errors.visible.ok_or("a scene without visible pixels")?.bad[1]);
    }
    eprintln!("{} {order}: {:?}", found.scene, found.energies.last());
    Ok(found)
}

impl Record {
    fn of<'a>(&'a self, order: &str) -> Vec<&'a Run> {
        self.runs.iter().filter(|run| run.order == order).collect()
    }

    /// The energy after so many loops over the final one of BP, mean over the scenes.
    fn energy(&self, order: &str, loops: usize) -> f64 {
        let bp = self.of(ORDERS[0]);
        let ratio = |(run, bp): (&&Run, &&Run)| run.energies[loops - 1] as f64 / last(bp);
        mean(self.of(order).iter().zip(&bp).map(ratio))
    }
}

/// The energy after all loops.
fn last(run: &Run) -> f64 {
    run.energies.last().copied().unwrap_or(0) as f64
}

/// The first loop from which on the energy stays within 1 % of this one, or below; `None` if it never does.
fn loops_until(run: &Run, energy: f64) -> Option<usize> {
    let above = run.energies.iter().rposition(|&of_loop| of_loop as f64 > 1.01 * energy);
    Some(above.map_or(0, |index| index + 1) + 1).filter(|&loops| loops <= run.energies.len())
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<_> = values.collect();
    values.iter().sum::<f64>() / values.len() as f64
}

/// The table of docs/claims.md, and how it was made.
fn page(record: &Record) -> Result<String> {
    let mut text = String::from("# Start nodes\n\n");
    let header = |what: &str| SHOWN.map(|loops| format!(" {what} {loops} |")).concat();
    writeln!(
        text,
        "| passing |{}{} loops to 1 % of its own end | to 1 % of BP's end |",
        header("energy,"),
        header("wrong,")
    )?;
    writeln!(text, "|---|{}", "---:|".repeat(2 * SHOWN.len() + 2))?;
    for order in ORDERS {
        let runs = record.of(order);
        let energies = SHOWN.map(|loops| format!(" {:.3} |", record.energy(order, loops))).concat();
        let bad = SHOWN.map(|loops| format!(" {:.1} |", mean(runs.iter().map(|run| run.bad[loops - 1])))).concat();
        let bp = record.of(ORDERS[0]);
        let own: Vec<_> = runs.iter().map(|run| loops_until(run, last(run))).collect();
        let common: Vec<_> = runs.iter().zip(&bp).map(|(run, bp)| loops_until(run, last(bp))).collect();
        writeln!(text, "| {order} |{energies}{bad} {} | {} |", shown(&own), shown(&common))?;
    }
    let Record { program, machine, labels, .. } = record;
    let changes = if program.clean_tree { "" } else { " with changes" };
    writeln!(
        text,
        "\nMeans over the thesis's six scenes at half size, L = {labels}, profile `thesis`, reference backend. Energies after so many loops \
         are divided by that of `sync` after {LOOPS}. *Wrong* is the percentage of non-occluded pixels with an error above 1 px.\n\n\
         Measured at commit {}{changes} on {}, {} cores. Each loop of each scene: `energies.json`.",
        program.commit, machine.cpu, machine.cores
    )?;
    Ok(text)
}

/// The mean over the scenes with its range.
fn shown(loops: &[Option<usize>]) -> String {
    let Some(reached) = loops.iter().copied().collect::<Option<Vec<_>>>() else {
        return format!("not on {} of {} scenes", loops.iter().filter(|loops| loops.is_none()).count(), loops.len());
    };
    let (low, high) = (reached.iter().min().copied().unwrap_or(0), reached.iter().max().copied().unwrap_or(0));
    format!("{:.0} ({low} to {high})", mean(reached.iter().map(|&loops| loops as f64)))
}

fn chart(record: &Record) -> Plot {
    let series = ORDERS.iter().enumerate().map(|(index, order)| Series {
        name: order.replace('`', ""),
        style: Style::numbered(index).with_line(if index < 4 { Line::Solid } else { Line::Dashes }),
        points: SHOWN_IN_CHART.map(|loops| Point::new(loops as f64, record.energy(order, loops))).to_vec(),
    });
    Plot {
        title: "Energy against loops".to_owned(),
        description: format!("Energy after each number of loops. Series: {}.", ORDERS.join("; ")),
        x: Axis { ticks: SHOWN_IN_CHART.map(|loops| loops as f64).to_vec(), ..Axis::logarithmic("loops") },
        y: Axis::logarithmic("energy / that of sync after 112 loops, mean over six scenes"),
        levels: Vec::new(),
        keys: Vec::new(),
        series: series.collect(),
    }
}

/// The loops of the chart's points.
const SHOWN_IN_CHART: [usize; 10] = [1, 2, 3, 5, 8, 12, 20, 35, 60, 112];
