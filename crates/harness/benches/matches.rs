//! Whole matches and kernels, each measured by criterion in its own way.
//!
//! `[BP_BENCH=quick] [BP_BENCH_BACKEND=NAMES] [BP_DATA=DIR] cargo bench --bench matches [-- CRITERION'S OPTIONS]`
//!
//! A match is one plan on the first scene, from images to labels, the wait for the device included. A kernel is one stage of
//! such a match, over all grids and loops, by the device's clock if it has one. Criterion measures one bench after another, so compare its times
//! with those of an earlier run, not with each other: ratios come from `benches/thesis.rs`, `bp reproduce` and `bp speed`.

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
            whole_match(&mut criterion, planned.name, runner, &scene, &plan);
            if OF_KERNELS.contains(&planned.name) {
                kernels(&mut criterion, planned.name, runner, &scene, &plan)?;
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

fn whole_match(criterion: &mut Criterion, name: &str, runner: &Runner, scene: &Scene, plan: &Plan) {
    let mut group = criterion.benchmark_group("match");
    group.throughput(Throughput::Elements(plan.message_updates()));
    group.bench_function(BenchmarkId::new(name, &runner.name), |bencher| {
        let mut solve = Solve::prepare(runner, plan.clone(), &scene.pair).unwrap_or_else(|failure| fail(&failure));
        bencher.iter(|| sample(&mut solve));
    });
}

/// The stages that the device does one after another, with the bytes that each must at least move.
fn kernels(criterion: &mut Criterion, name: &str, runner: &Runner, scene: &Scene, plan: &Plan) -> Result<(), Failure> {
    let mut solve = Solve::prepare(runner, plan.clone(), &scene.pair)?;
    let moved = solve.driver.moved_bytes().unwrap_or_default();
    for (stage, bytes) in Stage::ALL.into_iter().zip(moved).filter(|&(_, bytes)| bytes > 0) {
        let mut group = criterion.benchmark_group(format!("kernel {}", stage.name()));
        group.throughput(Throughput::Bytes(bytes));
        group.bench_function(BenchmarkId::new(name, &runner.name), |bencher| {
            let mut ms = || sample(&mut solve).stages_ms()[stage as usize];
            bencher.iter_custom(|solves| Duration::from_secs_f64((0..solves).map(|_| ms()).sum::<f64>() / 1e3));
        });
    }
    Ok(())
}

fn sample(solve: &mut Solve<'_>) -> Sample {
    solve.sample(0, &Meter::new(&Watch::default())).unwrap_or_else(|failure| fail(&failure))
}

/// Criterion's closures cannot fail otherwise.
fn fail(failure: &Failure) -> ! {
    eprintln!("{failure}");
    exit(1)
}
