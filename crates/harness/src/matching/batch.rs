//! Many pairs with one command: what is complete stays, what is not is matched, one pair after another on one device,
//! while the next is read and the last is written.
//!
//! Nothing but files tells how far a batch has come, so that it may end at any moment and in any way: outputs are
//! written whole, and after them the record of the pair, whole too, with checksums of what went in and came out.
//! Processes that share the work share no file but those.

mod job;
mod record;
mod run;
mod shard;
mod summary;

use std::io::Write as _;

use bp_core::{Algorithm, Schedule};
pub(crate) use shard::Shard;
use summary::Summary;

use super::{Making, pairs};
use crate::{
    args::{MatchArgs, OutputArgs},
    command::print_json,
    failure::Failure,
    files, interrupt,
    matching::batch::job::Job,
    note, threads,
};

/// Matches all pairs that the options name.
pub(crate) fn match_all(args: &MatchArgs) -> Result<(), Failure> {
    let swept = args.plan.algorithm() == Algorithm::Sweep || args.plan.schedule == Some(Schedule::Sweep);
    if args.many.warm_start.is_some() && swept {
        let what = "--warm-start needs messages that are kept; of the schedule sweep they are not";
        return Err(Failure::usage(format!("{what}: take --algorithm cfbp --half-steps 10, say")));
    }
    let OutputArgs { picture, depth, points, .. } = &args.outputs;
    if picture.is_some() || depth.is_some() || points.is_some() {
        let what = "--picture, --depth and --points name one file";
        return Err(Failure::usage(format!("{what}: of many pairs take --also picture,depth,points")));
    }
    let found = pairs::find(args)?;
    found.notes.iter().for_each(|line| note(line));
    let shard = args.many.shard.unwrap_or_default();
    let making = Making::of(&args.outputs.making)?;
    let jobs = job::jobs(args, &making, &found.pairs, shard)?;
    interrupt::listen()?;
    files::name_temporary(&format!(".bp-{}-", shard.file_part()));
    job::clear_leftovers(args, &jobs, shard)?;
    let settings = record::settings_sha256(args);
    let is_complete = |chain: &&[Job]| !args.many.force && chain.iter().all(|job| job.is_complete(&settings));
    let chains = jobs.chunk_by(|a, b| a.chain == b.chain);
    let due: Vec<&Job> = chains.filter(|chain| !is_complete(chain)).flatten().collect();
    due.iter().try_for_each(|job| job.check(&making))?;
    if !due.is_empty() {
        let ran = threads::run_on(args.plan.threads, || run::run(args, &making, &due, &settings));
        ran.inspect_err(|failure| {
            if failure.is_interrupted() {
                note("the same command goes on with the pairs that are not complete");
            }
        })?;
    }
    let summary = Summary::of(args, shard, &jobs, jobs.len() - due.len())?;
    let told = summary::path(&args.output, shard);
    summary.write(&told)?;
    if args.json {
        print_json(&summary)?
    } else {
        write!(std::io::stdout(), "{}", summary.text())?
    }
    summary.outcome(&told)
}
