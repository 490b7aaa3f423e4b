//! Whole matches and kernels, each measured by criterion in its own way.
//!
//! `[BP_BENCH=quick] [BP_BENCH_BACKEND=NAMES] [BP_DATA=DIR] cargo bench --bench matches [-- CRITERION'S OPTIONS]`
//!
//! A match is one plan on the first scene, from images to labels, the wait for the device included. A kernel is one stage
//! of such a match, over all grids and loops, by the device's clock if it has one. Criterion measures one bench after
//! another, so compare its times with those of an earlier run, not with each other: ratios come from `benches/thesis.rs`,
//! `bp reproduce` and `bp speed`.

use std::{
    process::{ExitCode, exit},
    time::Duration,
};

use bp_core::{Plan, Stage};
use bp_stereo::Watch;
use criterion::{BenchmarkId, Criterion, Throughput};
use harness::{
    Failure,
    bench::Settings,
    measure::{Asked, Meter, Runner, Solve},
    record::Sample,
    reproduce,
    scenes::Scene,
    threads,
};

/// The plans whose stages are measured as kernels.
const OF_KERNELS: [&str; 2] = ["bp", "hierarchy"];

fn main() -> ExitCode {
    match threads::run_on(None, run) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("{failure}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Failure> {
    let settings = Settings::read(|name| std::env::var_os(name))?;
    let mut criterion = criterion(settings.quick);
    let devices = settings.open(&Watch::default())?;
    let source = settings.source()?;
    let scene = source.load(0)?;
    let asked = reproduce::settings(&source, &devices, settings.quick, 1);
    for planned in reproduce::plans() {
        let plan = planned.plan(scene.pair.size(), asked.labels, asked.k)?;
        for runner in Asked::opened(&devices) {
            if let Err(failure) = runner.on_device(|device| Ok(device.check(&plan)?)) {
                eprintln!("{} on {}: left out: {failure}", planned.name, runner.name);
                continue;
            }
            whole_match(&mut criterion, planned.name, runner, &scene, &plan);
            if OF_KERNELS.contains(&planned.name) && times_stages(runner, &scene, &plan) {
                kernels(&mut criterion, planned.name, runner, &scene, &plan);
            }
        }
    }
    criterion.final_summary();
    Ok(())
}

/// Criterion with as few samples as it accepts, since a match may take seconds.
fn criterion(quick: bool) -> Criterion {
    let (warm_up, measurement) = if quick { (100, 500) } else { (1000, 4000) };
    Criterion::default()
        .without_plots()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(warm_up))
        .measurement_time(Duration::from_millis(measurement))
        .configure_from_args()
}

/// Criterion calls the closure for every sample; all of them take the same prepared plan.
fn whole_match(criterion: &mut Criterion, name: &str, runner: &Runner, scene: &Scene, plan: &Plan) {
    let mut prepared = None;
    criterion.benchmark_group("match").bench_function(BenchmarkId::new(name, &runner.name), |bencher| {
        let solve = prepared.get_or_insert_with(|| prepare(runner, scene, plan));
        bencher.iter(|| sample(solve));
    });
}

/// The stages that the device does one after another, with the bytes that each must at least move.
fn kernels(criterion: &mut Criterion, name: &str, runner: &Runner, scene: &Scene, plan: &Plan) {
    let mut prepared = None;
    for (stage, bytes) in Stage::ALL.into_iter().zip(plan.moved_bytes().unwrap_or_default()) {
        // A backend that refines while it updates messages has no such kernel.
        if bytes == 0 || stage == Stage::Refine {
            continue;
        }
        let mut group = criterion.benchmark_group(format!("kernel {}", stage.name()));
        group.throughput(Throughput::Bytes(bytes));
        group.bench_function(BenchmarkId::new(name, &runner.name), |bencher| {
            let solve = prepared.get_or_insert_with(|| prepare(runner, scene, plan));
            let mut ms = || sample(solve).stages_ms()[stage as usize];
            bencher.iter_custom(|solves| Duration::from_secs_f64((0..solves).map(|_| ms()).sum::<f64>() / 1e3));
        });
    }
}

/// Whether stages have times of their own: calls to a processor take as long as the work, and other devices need a clock.
fn times_stages(runner: &Runner, scene: &Scene, plan: &Plan) -> bool {
    runner.waits() || sample(&mut prepare(runner, scene, plan)).device_ms().is_some()
}

/// A prepared plan that was solved once.
fn prepare<'a>(runner: &'a Runner, scene: &'a Scene, plan: &Plan) -> Solve<'a> {
    let mut solve = Solve::prepare(runner, plan.clone(), &scene.pair).unwrap_or_else(|failure| fail(&failure));
    sample(&mut solve);
    solve
}

fn sample(solve: &mut Solve<'_>) -> Sample {
    solve.sample(0, &Meter::new(&Watch::default())).unwrap_or_else(|failure| fail(&failure))
}

/// Criterion's closures cannot fail otherwise.
fn fail(failure: &Failure) -> ! {
    eprintln!("{failure}");
    exit(1)
}
