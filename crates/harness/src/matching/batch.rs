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

use std::{io::Write as _, path::PathBuf};

use bp_core::{Algorithm, Schedule};
pub(crate) use shard::Shard;
use summary::{Failed, Summary};

use super::{Making, pairs};
use crate::{
    args::{Also, FinishArgs, Labels, MatchArgs, OutputArgs},
    command::print_json,
    failure::Failure,
    files, interrupt,
    matching::batch::job::Job,
    note, threads,
};

/// Matches all pairs that the options name.
pub(crate) fn match_all(args: &MatchArgs) -> Result<(), Failure> {
    check_options(args)?;
    let args = &as_for_one(args);
    let found = pairs::find(args)?;
    found.notes.iter().for_each(|line| note(line));
    let shard = args.many.shard.unwrap_or_default();
    let making = Making::of(&args.outputs)?;
    let jobs = job::jobs(args, &making, &found.pairs, shard)?;
    interrupt::listen()?;
    files::name_temporary(&format!(".bp-{}-", shard.file_part()));
    let _lock = shard.lock(&args.output.join(job::RECORDS))?;
    job::clear_leftovers(args, &jobs, shard)?;
    let settings = record::settings_sha256(args, &making);
    let is_complete = |chain: &&[Job]| !args.many.force && job::are_complete(chain, &settings);
    let chains = jobs.chunk_by(|a, b| a.chain == b.chain);
    let due: Vec<&Job> = chains.filter(|chain| !is_complete(chain)).flatten().collect();
    due.iter().try_for_each(|job| job.check(&making))?;
    let failures = match_due(args, &making, &due, &settings)?;
    let summary = Summary::of(args, shard, &jobs, jobs.len() - due.len(), failures)?;
    let told = summary::path(&args.output, shard);
    summary.write(&told)?;
    if args.json {
        print_json(&summary)?
    } else {
        write!(std::io::stdout(), "{}", summary.text())?
    }
    summary.outcome(&told)
}

/// Matches what is to be done; tells which pairs have failed.
fn match_due(args: &MatchArgs, making: &Making, due: &[&Job], settings_sha256: &str) -> Result<Vec<Failed>, Failure> {
    if due.is_empty() {
        return Ok(Vec::new());
    }
    let ran = threads::run_on(args.plan.threads, || run::run(args, making, due, settings_sha256));
    ran.inspect_err(|failure| {
        if failure.is_interrupted() {
            let again = if args.many.force { "the same command without --force" } else { "the same command" };
            note(&format!("{again} goes on with the pairs that are not complete"));
        }
    })
}

/// Refuses options that are for one pair, and folders that no record can name.
fn check_options(args: &MatchArgs) -> Result<(), Failure> {
    let OutputArgs { picture, depth, points, .. } = &args.outputs;
    if [picture, depth, points, &args.finish.confidence].into_iter().any(Option::is_some) {
        let what = "--picture, --depth, --points and --confidence name one file";
        return Err(Failure::usage(format!("{what}: of many pairs take --also picture,depth,points,confidence")));
    }
    for folder in [Some(&args.output), args.many.pairs.as_ref()].into_iter().flatten() {
        if std::path::absolute(folder).is_ok_and(|folder| folder.to_str().is_none()) {
            let what = "is no name in UTF-8, as the records of many pairs hold it";
            return Err(Failure::usage(format!("{} {what}; rename it", folder.display())));
        }
    }
    check_warm_start(args)
}

/// Refuses warm starts where there are no messages to start from.
fn check_warm_start(args: &MatchArgs) -> Result<(), Failure> {
    if args.many.warm_start.is_none() {
        return Ok(());
    }
    let swept = args.plan.algorithm() == Algorithm::Sweep || args.plan.schedule == Some(Schedule::Sweep);
    if args.plan.labels == Some(Labels::Auto) {
        return Err(Failure::usage("--warm-start needs the same labels for all frames: give --labels a number"));
    }
    let both_views = args.finish.check.is_some() || args.many.also.contains(&Also::Confidence);
    if swept || both_views {
        let what = "--warm-start needs messages of the frame before, which the schedule sweep does not keep";
        let advice = "take --algorithm cfbp --half-steps 10, say, and neither --check nor --also confidence";
        return Err(Failure::usage(format!("{what}, and matching both views overwrites: {advice}")));
    }
    Ok(())
}

/// The options as they would be for one pair: that there is a file says what is computed and what memory that takes.
fn as_for_one(args: &MatchArgs) -> MatchArgs {
    let file = |what| args.many.also.contains(&what).then(PathBuf::new);
    MatchArgs {
        outputs: OutputArgs {
            picture: file(Also::Picture),
            depth: file(Also::Depth),
            points: file(Also::Points),
            ..args.outputs.clone()
        },
        finish: FinishArgs { confidence: file(Also::Confidence), ..args.finish.clone() },
        ..args.clone()
    }
}
