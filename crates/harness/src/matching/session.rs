//! A device that is opened once and prepared anew only where a pair needs another plan than the one before.

use bp_core::{DisparityMap, Energy, Matcher, Plan, Progress, Side, StereoPair, Times};
use sha2::{Digest, Sha256};

use super::plan;
use crate::{
    args::MatchArgs,
    backends::{self, Opened},
    failure::Failure,
    files::hex,
    interrupt, record, threads,
};

/// An open device, and what it is prepared for.
pub(crate) struct Session<'a> {
    args: &'a MatchArgs,
    opened: Opened,
    matcher: Option<Matcher>,
    /// Whether the next pair is the next frame of a video and starts from the messages of the one before.
    pub(crate) starts_warm: bool,
}

/// What came out of a pair.
pub(crate) struct Answer {
    /// The disparity map.
    pub(crate) map: DisparityMap,
    /// Times of every match, in order.
    pub(crate) samples: Vec<Times>,
    /// The energy of the labels.
    pub(crate) energy: Energy,
    /// The settings as records tell them.
    pub(crate) settings: record::Settings,
    /// Bytes allocated for the plan.
    pub(crate) allocated_bytes: u64,
    /// SHA-256 of all final messages, where it was asked for.
    pub(crate) messages_sha256: Option<String>,
}

impl<'a> Session<'a> {
    /// Opens the device that the options name.
    pub(crate) fn open(args: &'a MatchArgs) -> Result<Self, Failure> {
        let opened = backends::open(&args.plan.backend, args.plan.device.as_deref())?;
        threads::check(args.plan.threads, &[&opened])?;
        Ok(Self { args, opened, matcher: None, starts_warm: false })
    }

    /// The device.
    pub(crate) fn opened(&self) -> &Opened {
        &self.opened
    }

    /// Matches a pair as often as the options say.
    pub(crate) fn solve(&mut self, pair: &StereoPair, plan: Plan) -> Result<Answer, Failure> {
        let Self { args, opened, matcher, starts_warm } = self;
        let plan = plan::fitting(args, plan, opened)?;
        let mut prepared = match matcher.take() {
            Some(prepared) if *prepared.plan() == plan => prepared,
            _ => Matcher::new(opened.device.as_ref(), plan)?,
        };
        let samples = take_samples(&mut prepared, pair, args.repeat, *starts_warm)?;
        let answer = Answer {
            map: prepared.disparities(),
            samples,
            energy: Energy::of(pair, prepared.plan().model(), prepared.labels())?,
            settings: plan::recorded_settings(&args.plan, prepared.plan(), opened),
            allocated_bytes: prepared.allocated_bytes(),
            messages_sha256: args.messages_hash.then(|| hash_messages(&mut prepared)).transpose()?,
        };
        interrupt::check()?;
        *matcher = Some(prepared);
        Ok(answer)
    }
}

/// Matches the pair so many times.
fn take_samples(matcher: &mut Matcher, pair: &StereoPair, repeat: u32, warm: bool) -> Result<Vec<Times>, Failure> {
    let updates = matcher.plan().message_updates();
    let bar = interrupt::ProgressBar::new(updates.saturating_mul(repeat.into()));
    let mut samples = Vec::new();
    for index in 0..u64::from(repeat) {
        let before = updates.saturating_mul(index);
        let observer = &mut |progress: Progress| bar.update(before.saturating_add(progress.done));
        let solve = if warm { Matcher::solve_warm_observed } else { Matcher::solve_observed };
        samples.push(solve(matcher, pair, observer)?);
    }
    bar.finish();
    Ok(samples)
}

fn hash_messages(matcher: &mut Matcher) -> Result<String, Failure> {
    let mut hash = Sha256::new();
    for side in Side::ALL {
        hash.update(matcher.messages(side)?);
    }
    Ok(hex(&hash.finalize()))
}
