//! The matcher. It opens a device once, and prepares it again only if a pair needs a different plan.

use std::{
    fmt,
    sync::Arc,
    time::{Duration, Instant},
};

use bp_core::{Alignment, DeviceInfo, Energy, Image, Plan, Progress, Side, StereoPair, Tiled, survey::Survey};
use rayon::ThreadPool;
use sha2::{Digest, Sha256};

use crate::{
    Align, Beside, Disparity, Ending, Error, Labels, Options, Tiles, Warning, Watch,
    devices::{self, Opened},
    finishing::{Finished, View, finished},
    memory::{self, Fitted, Images},
    plan::{self, labels, quarter_of_width},
    system, warning,
    watch::ending,
};

/// Matches pairs on one device. See the [crate's front page](crate) for an example.
pub struct Matcher {
    options: Options,
    pool: Arc<ThreadPool>,
    opened: Opened,
    beside: Beside,
    prepared: Option<Prepared>,
}

/// A tiled plan, prepared on the device.
struct Prepared {
    tiled: Tiled,
    /// What there is room for beside the tiles.
    images: Images,
    /// Predicted peak memory of the program, in bytes.
    peak_bytes: u64,
}

/// The plan of a pair, with warnings.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// The plan.
    pub plan: Plan,
    /// How the rows of the images differ; `None` if that was not asked for, or if too few points agree.
    pub alignment: Option<Alignment>,
    /// Possible problems with the pair or its labels.
    pub warnings: Vec<Warning>,
    /// Time that planning took.
    pub time: Duration,
}

/// The messages that a pair starts from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// None.
    #[default]
    Cold,
    /// Those of the previous pair. For the next frame of a video; matches on the full grid alone.
    Warm,
}

impl Matcher {
    /// Starts threads and opens the device that the options name.
    ///
    /// # Errors
    /// [`Error::Options`] if options contradict each other, [`Error::Unavailable`] if the device does not exist or
    /// cannot be opened, [`Error::System`] if threads cannot be started.
    pub fn new(options: &Options) -> Result<Self, Error> {
        options.check()?;
        let pool = Arc::new(system::thread_pool(options.threads)?);
        let opened = pool.install(|| devices::open(&options.backend, options.device.as_deref()))?;
        Ok(Self { options: options.clone(), pool, opened, beside: Beside::default(), prepared: None })
    }

    /// Declares what else the program holds in memory, so that a memory limit includes it.
    #[must_use]
    pub fn beside(self, beside: Beside) -> Self {
        Self { beside, ..self }
    }

    /// The options.
    #[must_use]
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The device.
    #[must_use]
    pub fn device(&self) -> &DeviceInfo {
        &self.opened.info
    }

    /// The device's name in options and records: its backend's, with its index unless that is 0.
    #[must_use]
    pub fn device_name(&self) -> &str {
        &self.opened.name
    }

    /// Matches two rectified images of one size.
    ///
    /// # Errors
    /// [`Error::Core`] if the images differ in size, [`Error::OutOfMemory`], and those of the device.
    pub fn compute(&mut self, left: &Image, right: &Image) -> Result<Disparity, Error> {
        let pair = StereoPair::new(left.clone(), right.clone())?;
        self.compute_watched(&pair, Start::Cold, &Watch::default())
    }

    /// Matches a pair. Progress goes to `watch`, in message entries.
    ///
    /// # Errors
    /// Those of [`Self::plan`] and [`Self::run`].
    pub fn compute_watched(&mut self, pair: &StereoPair, start: Start, watch: &Watch<'_>) -> Result<Disparity, Error> {
        // Once for both steps: handing work to another thread and back may take longer than a small pair.
        Arc::clone(&self.pool).install(|| {
            watch.check()?;
            let planned = self.plan(pair)?;
            self.run(pair, planned, start, watch)
        })
    }

    /// Matches a pair on the matcher's own threads. Meanwhile this thread runs `attend`, which may look after its caller's events.
    /// Returns when both are done.
    ///
    /// # Errors
    /// Those of [`Self::compute_watched`].
    ///
    /// # Panics
    /// If the work or `attend` panics.
    pub fn compute_attended(
        &mut self,
        pair: &StereoPair,
        start: Start,
        watch: &Watch<'_>,
        attend: impl FnOnce(&mut Ending),
    ) -> Result<Disparity, Error> {
        let pool = Arc::clone(&self.pool);
        let (running, mut ending) = ending();
        let mut solved = Err(Error::Stopped);
        pool.in_place_scope(|scope| {
            scope.spawn(|_| {
                solved = self.compute_watched(pair, start, watch);
                drop(running);
            });
            attend(&mut ending);
        });
        solved
    }

    /// Plans a pair. A quick survey of it finds possible problems, how rows differ, and the labels if they are
    /// [`crate::Labels::Auto`].
    ///
    /// # Errors
    /// [`Error::Core`] if the options ask for an impossible model or plan.
    pub fn plan(&self, pair: &StereoPair) -> Result<Planned, Error> {
        let (options, size, start) = (&self.options, pair.size(), Instant::now());
        let (survey, alignment) = self.pool.install(|| {
            let survey = if options.labels == Labels::Auto { Survey::of(pair) } else { Survey::coarse(pair) }?;
            let alignment = plan::alignment(options, pair, &survey)?;
            Ok::<_, Error>((survey, alignment))
        })?;
        let found = labels(options, size, &survey);
        let plan = plan::plan(options, pair, found.unwrap_or_else(|| quarter_of_width(options, size)))?;
        let warnings = warning::of(options, &survey, alignment.as_ref(), &plan, found.is_some());
        Ok(Planned { plan, alignment, warnings, time: start.elapsed() })
    }

    /// The most bytes that the program is predicted to hold while it matches a pair. Nothing is matched.
    ///
    /// # Errors
    /// Those of [`Self::plan`]; [`Error::OutOfMemory`] if the pair does not fit into [`Options::max_memory`] or what is free.
    pub fn peak_bytes(&self, pair: &StereoPair) -> Result<u64, Error> {
        let Self { options, opened, beside, .. } = self;
        let Planned { plan, alignment, .. } = self.plan(pair)?;
        let images = Images::of(pair, plan.model().profile(), applied(alignment).is_some());
        let fitted = || memory::fitted(options, *beside, &plan, images, opened, &Watch::default());
        Ok(self.pool.install(fitted)?.peak_bytes)
    }

    /// Matches a pair as planned. Progress goes to `watch`, in message entries.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] if the plan does not fit, [`Error::Stopped`], and those of the device. [`Error::Core`] if it cannot
    /// start warm.
    pub fn run(
        &mut self,
        pair: &StereoPair,
        planned: Planned,
        start: Start,
        watch: &Watch<'_>,
    ) -> Result<Disparity, Error> {
        let Self { options, pool, opened, beside, prepared } = self;
        let Planned { plan, alignment, warnings, time } = planned;
        if start == Start::Warm {
            // The first pair has no messages to start from yet. Its answer would not tell that the second one fails.
            opened.device.check_warm(&plan)?;
        }
        // A different plan is freed before the new one is prepared.
        let applied = applied(alignment);
        let images = Images::of(pair, plan.model().profile(), applied.is_some());
        let fits = |prepared: &Prepared| *prepared.tiled.plan() == plan && prepared.images == images;
        let before = prepared.take().filter(fits);
        let (ready, finished, energy, settings) = pool.install(|| {
            let mut ready = before.map_or_else(|| Prepared::new(options, *beside, &plan, images, opened, watch), Ok)?;
            let begun = Instant::now();
            let pair = aligned(pair.clone().compared_by(plan.model().profile()), applied.as_ref())?;
            let planning = time + begun.elapsed();
            let mut finished = ready.solve(options, opened, &pair, start, watch)?;
            finished.times.planning = planning;
            let energy_of = |labels| Energy::of(&pair, ready.tiled.plan().model(), labels);
            let energy = options.energy.then(|| energy_of(ready.tiled.labels())).transpose()?;
            // The memory that is planned depends on the number of threads.
            let settings = plan::described(options, ready.tiled.tiling(), alignment.as_ref(), opened)?;
            Ok::<_, Error>((ready, finished, energy, settings))
        })?;
        watch.check()?;
        let answer = Disparity {
            map: finished.map,
            confidence: finished.confidence,
            times: finished.times,
            energy,
            settings,
            tiles: Tiles::of(ready.tiled.tiling()),
            message_updates: ready.tiled.message_updates(),
            allocated_bytes: ready.tiled.allocated_bytes(),
            peak_bytes: ready.peak_bytes,
            warnings,
        };
        // Freeing the labels of tiles makes room for writing the answer.
        *prepared = Some(ready).filter(|ready| ready.tiled.tiling().is_whole());
        Ok(answer)
    }

    /// Aligns the rows of further pairs in this way.
    pub(crate) fn align(&mut self, align: Align) {
        self.options.align = align;
    }

    /// Fails if the device cannot start the next frame of a video from the messages of this one.
    pub(crate) fn check_warm(&self, plan: &Plan) -> Result<(), Error> {
        Ok(self.opened.device.check_warm(plan)?)
    }

    /// Bytes that the device holds for the next pair of the same plan.
    pub(crate) fn allocated_bytes(&self) -> u64 {
        self.prepared.as_ref().map_or(0, |prepared| prepared.tiled.allocated_bytes())
    }

    /// Frees those bytes. Returns whether there were any.
    pub(crate) fn free(&mut self) -> bool {
        self.prepared.take().is_some()
    }

    /// SHA-256 of all messages of the last pair: from the left, right, up and down, each `[height][width][labels]`.
    ///
    /// # Errors
    /// [`Error::Core`] if nothing was matched, or if the image was matched in tiles, which do not keep their messages.
    pub fn messages_sha256(&mut self) -> Result<String, Error> {
        let gone = bp_core::Error::Plan("messages are kept of images that are matched as a whole only");
        let prepared = self.prepared.as_mut().ok_or(gone)?;
        let mut hash = Sha256::new();
        for side in Side::ALL {
            hash.update(self.pool.install(|| prepared.tiled.messages(side))?);
        }
        Ok(bp_io::hex(&hash.finalize()))
    }
}

/// An alignment that changes anything.
fn applied(alignment: Option<Alignment>) -> Option<Alignment> {
    alignment.filter(|alignment| !alignment.is_negligible())
}

/// The pair with aligned rows, if there is an alignment.
fn aligned(pair: StereoPair, alignment: Option<&Alignment>) -> Result<StereoPair, Error> {
    match alignment {
        Some(alignment) => Ok(alignment.aligned(&pair)?),
        None => Ok(pair),
    }
}

impl fmt::Debug for Matcher {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { options, opened, .. } = self;
        out.debug_struct("Matcher").field("options", options).field("device", &opened.info).finish_non_exhaustive()
    }
}

impl Prepared {
    fn new(
        options: &Options,
        beside: Beside,
        plan: &Plan,
        images: Images,
        opened: &Opened,
        watch: &Watch<'_>,
    ) -> Result<Self, Error> {
        let Fitted { tiling, peak_bytes } = memory::fitted(options, beside, plan, images, opened, watch)?;
        let tiled = Tiled::new_unless(&|| watch.is_stopped(), opened.device.as_ref(), tiling)?;
        Ok(Self { tiled, images, peak_bytes })
    }

    fn solve(
        &mut self,
        options: &Options,
        opened: &Opened,
        pair: &StereoPair,
        start: Start,
        watch: &Watch<'_>,
    ) -> Result<Finished, Error> {
        let (tiled, device) = (&mut self.tiled, opened.device.as_ref());
        let tiling = tiled.tiling();
        let (updates, halved) = (tiling.message_updates(), tiling.halved_updates());
        // What the right image's map is compared with is right or wrong by whole pixels, so half the resolution is enough.
        let of_right = if start == Start::Cold { halved } else { updates };
        let total = updates.saturating_add(if options.needs_right() { of_right } else { 0 });
        let mut done = 0_u64;
        finished(options, pair, &|| watch.is_stopped(), |pair, view| {
            let observer =
                &mut |progress: Progress| watch.progress(done.saturating_add(progress.done).min(total), total);
            let times = match (start, view) {
                (Start::Cold, View::Right) => tiled.solve_halved_observed(device, pair, observer)?,
                (Start::Cold, View::Left) => tiled.solve_observed(device, pair, observer)?,
                (Start::Warm, _) => tiled.solve_warm_observed(device, pair, observer)?,
            };
            done = done.saturating_add(if view == View::Right { of_right } else { updates });
            // Freeing the tiles makes room for the map.
            tiled.free_tiles();
            Ok((times, tiled.disparities()?))
        })
    }
}

#[cfg(test)]
mod tests {
    use std::{thread, time::Duration};

    use super::*;
    use crate::Stop;

    #[test]
    fn the_caller_attends_while_its_pair_is_matched_and_may_stop_it() -> Result<(), Error> {
        let values: Vec<_> = (0..90 * 60_usize).map(|index| (index * index % 251) as u8).collect();
        let image = Image::from_grey(90, 60, values)?;
        let pair = StereoPair::new(image.clone(), image)?;
        let mut matcher = Matcher::new(&Options::default().with_labels(16))?;
        let mut attended_by = None;
        let attended = matcher.compute_attended(&pair, Start::Cold, &Watch::default(), |ending| {
            attended_by = Some(thread::current().id());
            while !ending.wait(Duration::from_millis(1)) {}
        })?;
        assert_eq!(attended_by, Some(thread::current().id()));
        assert_eq!(attended.map, matcher.compute(pair.left(), pair.right())?.map);

        let stop = Stop::default();
        let wait = |_: crate::Event<'_>| while !stop.is_stopped() {};
        let stopped =
            matcher.compute_attended(&pair, Start::Cold, &Watch::new(&wait, &stop), |_| assert!(!stop.stop()));
        assert_eq!(stopped.err(), Some(Error::Stopped));
        Ok(())
    }
}
