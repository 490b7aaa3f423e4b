//! `bp speed`: devices measured against each other on fixed problems, in turns and in one process, from the program
//! alone.

mod charts;
mod measure;
mod problems;
mod record;
mod tables;

use bp_core::Error;
use bp_testkit::synthetic;
use jiff::Timestamp;

pub(crate) use charts::{CHART_NAMES, Chart, charts};
pub(crate) use measure::milliseconds;
pub(crate) use problems::Problem;
pub(crate) use record::{Outcome, Speed};
pub(crate) use tables::page;

use crate::{
    args::SpeedArgs,
    backends::{Asked, Opened},
    failure::Failure,
    interrupt, machine, note,
};
use measure::Work;
use record::{Contestant, SCHEMA_VERSION};

/// Rounds of a run that is not quick.
const ROUNDS: u32 = 9;

/// What a quick run divides the sides of images by.
const QUICK_DIVISOR: usize = 3;

/// Measures what is asked for on these devices, of which one at least is open.
pub(crate) fn measure(args: &SpeedArgs, asked: &mut [Asked]) -> Result<Speed, Failure> {
    let mut speed = Speed {
        schema_version: SCHEMA_VERSION,
        started: Timestamp::now().to_string(),
        program: machine::program()?,
        machine: machine::machine(None),
        quick: args.quick,
        rounds: args.rounds.unwrap_or(if args.quick { 1 } else { ROUNDS }),
        threads: rayon::current_num_threads(),
        contestants: asked.iter().map(contestant).collect::<Result<_, _>>()?,
        contests: Vec::new(),
    };
    let mut opened: Vec<&mut Opened> = asked.iter_mut().filter_map(|asked| asked.device.as_mut().ok()).collect();
    let is_asked = |problem: &Problem| args.problem.is_empty() || problem.is_asked(&args.problem);
    let divisor = if args.quick { QUICK_DIVISOR } else { 1 };
    let with_plan = |problem: Problem| Ok((problem, problem.plan(divisor)?));
    let problems: Vec<_> = Problem::ALL.into_iter().filter(is_asked).map(with_plan).collect::<Result<_, Error>>()?;
    let solves = opened.len() as u64 * u64::from(1 + speed.rounds);
    let mut work = Work::new(problems.iter().map(|(_, plan)| solves * plan.message_updates()).sum());
    let scene = synthetic::scene(0, divisor).pair;
    for (problem, plan) in problems {
        let pair = problems::pair(&scene, plan.image_size())?;
        speed.contests.push(measure::contest((problem, plan), &pair, &mut opened, speed.rounds, &mut work)?);
    }
    work.finish();
    Ok(speed)
}

/// What is known of a contestant before the first problem.
fn contestant(asked: &Asked) -> Result<Contestant, Failure> {
    interrupt::check()?;
    let name = asked.name.clone();
    Ok(match &asked.device {
        Err(reason) => {
            Contestant { name, device: None, unavailable: Some(reason.clone()), open_ms: None, copy_gb_per_s: None }
        }
        Ok(opened) => Contestant {
            device: Some((&opened.info).into()),
            unavailable: None,
            open_ms: Some(measure::milliseconds(opened.open_time)),
            copy_gb_per_s: copy_gb_per_s(opened),
            name,
        },
    })
}

/// How fast a device copies. One that cannot tell may still solve problems.
fn copy_gb_per_s(opened: &Opened) -> Option<f64> {
    let rate = opened.device.copy_rate();
    let told = rate.inspect_err(|error| note(&format!("{}: its copy rate is not known: {error}", opened.name)));
    told.ok().flatten().map(|rate| rate / 1e9)
}
