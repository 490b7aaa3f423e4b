//! Matches pairs of any size in limited memory, one tile at a time.

mod around;
mod join;
mod tile;
mod tiling;

use std::{ops::ControlFlow, sync::Mutex, time::Instant};

pub use around::{Around, HALO};
pub use join::border;
pub use tile::{Span, Tile};
pub use tiling::{Needed, Tiling};

use join::Joint;

use crate::{
    Device, DisparityMap, Driver, Error, IsStopped, Observer, Plan, Progress, Side, StereoPair, Times, memory::Buffer,
    never,
};

/// A way to solve tiles.
#[derive(Clone, Copy)]
struct Way {
    solve: fn(&mut Driver, &StereoPair, &mut Observer<'_>) -> Result<Times, Error>,
    /// The message entries of a tile.
    updates: fn(&Plan) -> u64,
}

const WHOLLY: Way = Way { solve: Driver::solve_observed, updates: Plan::message_updates };
const HALVED: Way = Way { solve: Driver::solve_halved_observed, updates: Plan::halved_updates };

/// A tiled plan prepared on a device, ready to match one pair of its size after another. A plan with a single tile runs
/// as in [`Driver`], without a copy of the pair.
pub struct Tiled {
    tiling: Tiling,
    /// The driver of the tile that was matched last.
    driver: Option<Driver>,
    /// The labels of all tiles; empty if there is only one.
    labels: Buffer<u16>,
    most_bytes: u64,
    updates: u64,
}

impl Tiled {
    /// Prepares the first tile on `device`. Tiles of other sizes are prepared when their turn comes, after the previous
    /// tile is freed.
    ///
    /// # Errors
    /// Those of [`Device::prepare`].
    pub fn new(device: &dyn Device, tiling: Tiling) -> Result<Self, Error> {
        Self::new_unless(&never, device, tiling)
    }

    /// [`Tiled::new`] unless it is stopped.
    ///
    /// # Errors
    /// As [`Tiled::new`], and [`Error::Stopped`].
    pub fn new_unless(is_stopped: IsStopped<'_>, device: &dyn Device, tiling: Tiling) -> Result<Self, Error> {
        let pixels = if tiling.is_whole() { 0 } else { tiling.plan().image_size().pixels() };
        let labels = Buffer::filled_unless(is_stopped, "labels", pixels, 0)?;
        let mut tiled = Self { tiling, driver: None, labels, most_bytes: 0, updates: 0 };
        if let Some(tile) = tiled.tiling.tiles().first() {
            tiled.driver = Some(tiled.prepared(is_stopped, device, tile)?);
        }
        Ok(tiled)
    }

    /// How the plan is tiled.
    #[must_use]
    pub fn tiling(&self) -> &Tiling {
        &self.tiling
    }

    /// The plan of the whole image.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        self.tiling.plan()
    }

    /// The message entries that the last solve computed; see [`Driver::message_updates`].
    #[must_use]
    pub fn message_updates(&self) -> u64 {
        self.updates
    }

    /// The peak number of bytes allocated so far: for a tile, and for the labels of all tiles.
    #[must_use]
    pub fn allocated_bytes(&self) -> u64 {
        self.most_bytes + self.labels.bytes()
    }

    /// Matches a pair on the same device as in [`Tiled::new`]. [`Tiled::labels`] and [`Tiled::disparities`] hold the result
    /// until the next solve. Stage times are summed over all tiles. The total includes preparing tiles of other sizes. If the
    /// tiles need more memory than was likely, it starts again with smaller ones.
    ///
    /// # Errors
    /// As [`Driver::solve_observed`], and those of [`Device::prepare`].
    pub fn solve_observed(
        &mut self,
        device: &dyn Device,
        pair: &StereoPair,
        observer: &mut Observer<'_>,
    ) -> Result<Times, Error> {
        self.solve_by(WHOLLY, device, pair, observer)
    }

    /// As [`Tiled::solve_observed`], at half the resolution; see [`Driver::solve_halved_observed`].
    ///
    /// # Errors
    /// As [`Tiled::solve_observed`].
    pub fn solve_halved_observed(
        &mut self,
        device: &dyn Device,
        pair: &StereoPair,
        observer: &mut Observer<'_>,
    ) -> Result<Times, Error> {
        self.solve_by(HALVED, device, pair, observer)
    }

    fn solve_by(
        &mut self,
        way: Way,
        device: &dyn Device,
        pair: &StereoPair,
        observer: &mut Observer<'_>,
    ) -> Result<Times, Error> {
        let (found, expected) = (pair.size(), self.plan().image_size());
        if found != expected {
            return Err(Error::WrongSize { what: "the pair", found, expected });
        }
        let start = Instant::now();
        let mut times = self.solve_tiles(way, device, pair, observer);
        if let (Err(Error::OutOfMemory { .. }), Some(certain)) = (&times, self.tiling.certain().cloned()) {
            log::debug!("label sets need more memory than is usual: {:?} tiles instead", certain.counts());
            (self.tiling, self.driver) = (certain, None);
            times = self.solve_tiles(way, device, pair, observer);
        }
        times.map(|times| Times { total: start.elapsed(), ..times })
    }

    fn solve_tiles(
        &mut self,
        way: Way,
        device: &dyn Device,
        pair: &StereoPair,
        observer: &mut Observer<'_>,
    ) -> Result<Times, Error> {
        self.updates = 0;
        let (mut times, mut done, total) = (Times::default(), 0, self.tiling.sum_of_updates(way.updates));
        let tiles = self.tiling.tiles();
        for (index, tile) in tiles.iter().enumerate() {
            let mut driver = {
                let report = Mutex::new(&mut *observer);
                let is_stopped = || report.lock().is_ok_and(|mut report| report(Progress { done, total }).is_break());
                self.prepared(&is_stopped, device, tile)?
            };
            let observe = &mut |progress: Progress| observer(Progress { done: done + progress.done, total });
            let solved = self.solve_tile(way, &mut driver, pair, (tile, &tiles[..index]), observe);
            done += (way.updates)(driver.plan());
            // With label sets, a solve may allocate.
            let joined = if self.tiling.is_whole() { 0 } else { join::bytes(tile.size()) };
            self.most_bytes = self.most_bytes.max(driver.allocated_bytes() + joined);
            self.updates += driver.message_updates();
            self.driver = Some(driver);
            times += solved?;
        }
        Ok(times)
    }

    /// Matches the next frame of a video from the messages of the previous frame; see [`Driver::solve_warm_observed`].
    /// With several tiles no messages are kept, so every frame is matched like the first one.
    ///
    /// # Errors
    /// As [`Driver::solve_warm_observed`] and [`Tiled::solve_observed`].
    pub fn solve_warm_observed(
        &mut self,
        device: &dyn Device,
        pair: &StereoPair,
        observer: &mut Observer<'_>,
    ) -> Result<Times, Error> {
        match self.driver.as_mut().filter(|_| self.tiling.is_whole()) {
            Some(driver) => {
                self.updates = driver.plan().grid_updates(0);
                driver.solve_warm_observed(pair, observer)
            }
            None => self.solve_observed(device, pair, observer),
        }
    }

    /// [`Tiled::solve_observed`] without an observer.
    ///
    /// # Errors
    /// As [`Tiled::solve_observed`].
    pub fn solve(&mut self, device: &dyn Device, pair: &StereoPair) -> Result<Times, Error> {
        self.solve_observed(device, pair, &mut |_| ControlFlow::Continue(()))
    }

    fn solve_tile(
        &mut self,
        way: Way,
        driver: &mut Driver,
        pair: &StereoPair,
        (tile, matched): (&Tile, &[Tile]),
        observer: &mut Observer<'_>,
    ) -> Result<Times, Error> {
        if self.tiling.is_whole() {
            return (way.solve)(driver, pair, observer);
        }
        let part = tile.pair(&pair.clone().compared_by(driver.plan().model().profile()));
        let times = (way.solve)(driver, &part, observer)?;
        let (width, image) = (pair.size().width, &mut self.labels[..]);
        Joint { tile, labels: driver.labels(), matched, width, image }.copy()?;
        Ok(times)
    }

    /// Takes the current driver if it fits the tile. Otherwise frees it and prepares the tile's plan.
    fn prepared(&mut self, is_stopped: IsStopped<'_>, device: &dyn Device, tile: &Tile) -> Result<Driver, Error> {
        let plan = tile.plan(self.tiling.plan())?;
        let mut driver = match self.driver.take().filter(|driver| *driver.plan() == plan) {
            Some(driver) => driver,
            None => Driver::new_unless(is_stopped, device, plan)?,
        };
        driver.limit_bytes(self.tiling.limit(tile).unwrap_or(u64::MAX));
        self.most_bytes = self.most_bytes.max(driver.allocated_bytes());
        Ok(driver)
    }

    /// Frees everything but the last result if there are several tiles. A single tile holds the result, so it is kept.
    pub fn free_tiles(&mut self) {
        if !self.tiling.is_whole() {
            self.driver = None;
        }
    }

    /// The labels of the last solve, `[height][width]`.
    #[must_use]
    pub fn labels(&self) -> &[u16] {
        if self.tiling.is_whole() { self.driver.as_ref().map_or(&[], Driver::labels) } else { &self.labels }
    }

    /// The disparity map of the last solve. Allocates the map.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn disparities(&self) -> Result<DisparityMap, Error> {
        DisparityMap::from_labels(self.plan().image_size(), self.plan().model(), self.labels())
    }

    /// The last messages received from `side`; see [`Driver::messages`].
    ///
    /// # Errors
    /// As [`Driver::messages`]; also [`Error::Plan`] if there are several tiles, which do not keep their messages.
    pub fn messages(&mut self, side: Side) -> Result<Vec<u8>, Error> {
        match self.driver.as_mut().filter(|_| self.tiling.is_whole()) {
            Some(driver) => driver.messages(side),
            None => Err(Error::Plan("messages are kept of images that are matched as a whole only")),
        }
    }
}
