//! A device that is opened once and prepared anew only where a pair needs another plan than the one before.

use bp_core::{Device, DisparityMap, Energy, Plan, Progress, Side, StereoPair, Tiled};
use sha2::{Digest, Sha256};

use super::{
    Sample,
    finishing::{Finished, finished},
    memory::{self, Fitted},
    plan,
    report::Tiles,
};
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
    /// And how many bytes it was predicted to take.
    prepared: Option<(Tiled, u64)>,
    /// Whether the next pair is the next frame of a video and starts from the messages of the one before.
    pub(crate) starts_warm: bool,
}

/// What came out of a pair.
pub(crate) struct Answer {
    /// The disparity map.
    pub(crate) map: DisparityMap,
    /// How far it can be trusted, `[height][width]`, where that was asked for.
    pub(crate) confidence: Option<Vec<f32>>,
    /// Times of every match, in order.
    pub(crate) samples: Vec<Sample>,
    /// The energy of the labels.
    pub(crate) energy: Energy,
    /// The settings as records tell them.
    pub(crate) settings: record::Settings,
    /// The tiles, where the pair was not matched as a whole.
    pub(crate) tiles: Option<Tiles>,
    /// Bytes allocated for the plan.
    pub(crate) allocated_bytes: u64,
    /// Most bytes that the program was predicted to hold at a time.
    pub(crate) peak_bytes: u64,
    /// SHA-256 of all final messages, where it was asked for.
    pub(crate) messages_sha256: Option<String>,
}

impl<'a> Session<'a> {
    /// Opens the device that the options name.
    pub(crate) fn open(args: &'a MatchArgs) -> Result<Self, Failure> {
        let opened = backends::open(&args.plan.backend, args.plan.device.as_deref())?;
        threads::check(args.plan.threads, std::slice::from_ref(&opened.name), [opened.info.workers])?;
        Ok(Self { args, opened, prepared: None, starts_warm: false })
    }

    /// The device.
    pub(crate) fn opened(&self) -> &Opened {
        &self.opened
    }

    /// Matches a pair as often as the options say.
    pub(crate) fn solve(&mut self, pair: &StereoPair, plan: Plan) -> Result<Answer, Failure> {
        let Self { args, opened, prepared, starts_warm } = self;
        let device = opened.device.as_ref();
        // What was prepared for another plan is freed first.
        let (mut tiled, peak_bytes) = match prepared.take().filter(|(tiled, _)| *tiled.plan() == plan) {
            Some(prepared) => prepared,
            None => {
                let Fitted { tiling, peak_bytes } = memory::fitted(args, &plan, opened)?;
                (Tiled::new(device, tiling)?, peak_bytes)
            }
        };
        let (samples, last) = take_samples(args, &mut tiled, device, (pair, *starts_warm))?;
        let messages_sha256 = args.messages_hash.then(|| hash_messages(&mut tiled)).transpose()?;
        let answer = Answer {
            energy: Energy::of(pair, tiled.plan().model(), tiled.labels())?,
            map: last.map,
            confidence: last.confidence,
            samples,
            settings: record::Settings {
                finish: record::Finish::of(args.finish.finish()),
                ..plan::recorded_settings(&args.plan, tiled.tiling(), opened)?
            },
            tiles: Tiles::of(tiled.tiling()),
            allocated_bytes: tiled.allocated_bytes(),
            peak_bytes,
            messages_sha256,
        };
        interrupt::check()?;
        // Labels of tiles make room for writing the answer.
        *prepared = tiled.tiling().is_whole().then_some((tiled, peak_bytes));
        Ok(answer)
    }
}

/// Matches the pair as often as the options say; the last answer stays.
fn take_samples(
    args: &MatchArgs,
    tiled: &mut Tiled,
    device: &dyn Device,
    (pair, starts_warm): (&StereoPair, bool),
) -> Result<(Vec<Sample>, Finished), Failure> {
    let updates = tiled.tiling().message_updates();
    let matches = u64::from(args.repeat) * if args.finish.needs_right() { 2 } else { 1 };
    let bar = interrupt::ProgressBar::new(updates.saturating_mul(matches));
    let mut done = 0_u64;
    let mut solve = |pair: &StereoPair| {
        let observer = &mut |progress: Progress| bar.update(done.saturating_add(progress.done));
        let solve = if starts_warm { Tiled::solve_warm_observed } else { Tiled::solve_observed };
        let times = solve(tiled, device, pair, observer)?;
        done = done.saturating_add(updates);
        // The memory of tiles is for the map.
        tiled.free_tiles();
        Ok::<_, Failure>((times, tiled.disparities()))
    };
    let mut samples = Vec::new();
    // Only one answer is in memory at a time.
    loop {
        let answer = finished(&args.finish, pair, &mut solve)?;
        samples.push(answer.sample);
        if samples.len() >= args.repeat as usize {
            bar.finish();
            return Ok((samples, answer));
        }
    }
}

fn hash_messages(tiled: &mut Tiled) -> Result<String, Failure> {
    let mut hash = Sha256::new();
    for side in Side::ALL {
        hash.update(tiled.messages(side)?);
    }
    Ok(hex(&hash.finalize()))
}
