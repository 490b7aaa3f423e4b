//! The memory that a match takes, known before it begins, and how its plan is tiled to stay within a limit.

use bp_core::{Likeness, Plan, Schedule, Size, Tiling};

use crate::{Error, Options, Watch, devices::Opened, error::iec, system::Memory};

/// The program itself, with the stacks of its threads and what allocators keep.
const PROGRAM: u64 = 16 << 20;

/// Bytes a pixel of both images.
const PAIR: u64 = 6;

/// Bytes a pixel of known truth.
const TRUTH: u64 = 5;

/// Bytes per pixel of the map, and of the largest output made from it: a picture with a colour bar.
const MAP: u64 = 4;
const WRITING: u64 = 8;

/// Bytes a pixel of labels, which are there until the map is to be written.
const LABELS: u64 = 2;

/// Bytes a pixel of a pair that is read while another is matched: one image, the other one decoded and copied, its file.
const READING: u64 = 12;

/// Bytes a pixel of a confidence.
const TRUST: u64 = 4;

/// Bytes a pixel of depths.
const DEPTH: u64 = 4;

/// Bytes a pixel of the mirrored pair while the right image is matched, more than what is kept of it.
const RIGHT: u64 = 6;

/// Bytes a pixel of what finishing a map takes for a time: a map with a frame and the next map; for the confidence, with
/// both maps, two maps with frames and what a pixel is worth.
const FINISHING: u64 = 8;
const CONFIDENCE: u64 = 20;

/// Bytes a pixel of what finding surfaces takes.
const SPECKLE: u64 = 9;

/// What a program holds beside the matcher, so that a memory limit includes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Beside {
    /// Whether ground truth is in memory.
    pub truth: bool,
    /// Whether depths are made of the map.
    pub depth: bool,
    /// Whether the next pair is read and the last one written meanwhile.
    pub batch: bool,
    /// The option that needs all messages at once, where there is one: then the image cannot be tiled.
    pub whole: Option<&'static str>,
}

/// How a plan is tiled, and what it takes.
pub(crate) struct Fitted {
    /// The tiles.
    pub(crate) tiling: Tiling,
    /// Most bytes that the program will hold at a time, predicted: images, tiles, answer and what is made of it.
    pub(crate) peak_bytes: u64,
}

/// Tiles `plan` to stay within the options' limit and the memory that there is; tells `watch` where the image is not
/// matched as a whole. The plan itself stays what it is: tiles cost less accuracy than a smaller plan.
pub(crate) fn fitted(
    options: &Options,
    beside: Beside,
    plan: &Plan,
    opened: &Opened,
    watch: &Watch<'_>,
) -> Result<Fitted, Error> {
    let bytes = Bytes::beside(options, beside, plan.image_size());
    let limit = Limit::of(options, opened, bytes.held);
    let needed = |tile: &Plan| {
        opened.device.check(tile)?;
        // A whole image stays prepared while its answer is finished.
        let kept = if tile.image_size() == plan.image_size() { bytes.finishing } else { 0 };
        Ok(opened.device.planned_bytes(tile).saturating_add(kept))
    };
    let room = limit.bytes.saturating_sub(bytes.held + bytes.coming);
    let tiling = match Tiling::within(plan, room, &needed) {
        Err(bp_core::Error::OutOfMemory { needed, available, .. }) if available == Some(room) => {
            return Err(limit.refuse(plan, bytes.peak(needed)));
        }
        tiling => tiling?,
    };
    let peak_bytes = bytes.peak(tiling.bytes(&needed)?);
    if peak_bytes > limit.bytes {
        return Err(limit.refuse(plan, peak_bytes));
    }
    if !tiling.is_whole() {
        let whole = needed(plan).map(|needed| bytes.peak(needed));
        check_whole(beside, &whole, limit.bytes)?;
        let whole = whole.map_or_else(|error| error.to_string(), |bytes| format!("needs {}", iec(bytes)));
        let text = format!("the whole image {whole}: matching {} in {}", described(&tiling), iec(peak_bytes));
        if tiling.likeness() == Likeness::Same { watch.note(&text) } else { watch.warn(&text) }
    }
    Ok(Fitted { tiling, peak_bytes })
}

/// Refuses an option that needs all messages at once.
fn check_whole(beside: Beside, needed: &Result<u64, bp_core::Error>, available: u64) -> Result<(), Error> {
    let Some(option) = beside.whole else { return Ok(()) };
    let needed = needed.clone()?;
    let advice = format!("`{option}` needs the whole image in memory at once: leave it out, or raise `max_memory`");
    Err(Error::OutOfMemory { needed, available, reason: "there for the whole image", advice })
}

/// Bytes beside those of tiles.
struct Bytes {
    /// Held already now, and all the time.
    held: u64,
    /// Held soon, and at any time from then on.
    coming: u64,
    /// Held once the labels are there. Their energy needs less than what comes later.
    finishing: u64,
}

impl Bytes {
    fn beside(options: &Options, beside: Beside, size: Size) -> Self {
        let a_pixel = |bytes: u64| bytes * size.pixels() as u64;
        let if_so = |is_so: bool, bytes: u64| if is_so { bytes } else { 0 };
        let (truth, depth) = (if_so(beside.truth, TRUTH), if_so(beside.depth, DEPTH));
        let (right, trust) = (if_so(options.needs_right(), RIGHT), if_so(options.confidence, TRUST));
        let finishing = if options.confidence { CONFIDENCE } else { FINISHING };
        let finishing = finishing.max(if_so(options.speckle.is_some(), SPECKLE));
        // The next pair of a batch and the last one count as this one's size.
        let others = if_so(beside.batch, READING + PAIR + MAP + trust + depth + WRITING);
        Self {
            held: PROGRAM + a_pixel(PAIR + truth),
            coming: a_pixel(right + others),
            finishing: a_pixel(MAP + (WRITING + depth).max(LABELS + finishing)),
        }
    }

    /// Most bytes that are held, where tiles need so many.
    fn peak(&self, tiles: u64) -> u64 {
        (self.held + self.coming).saturating_add(tiles.max(self.finishing))
    }
}

/// A tiling in words.
fn described(tiling: &Tiling) -> String {
    let ((columns, rows), size, answer) = (tiling.counts(), tiling.tile_size(), tiling.likeness().name());
    format!("{columns}x{rows} tiles of up to {size} pixels, which give {answer} (docs/big-images.md),")
}

/// How many bytes the program may hold.
struct Limit {
    bytes: u64,
    /// Who says so.
    reason: &'static str,
    /// Whether the caller could allow more.
    can_be_raised: bool,
}

impl Limit {
    /// The lower one of `max_memory` and, unless the device has memory of its own, of what is held and what is free.
    fn of(options: &Options, opened: &Opened, held: u64) -> Self {
        let free = Memory::available_to(opened.info.kind).map_or(u64::MAX, |free| free.saturating_add(held));
        match options.max_memory.filter(|&allowed| allowed <= free) {
            Some(bytes) => Self { bytes, reason: "allowed by `max_memory`", can_be_raised: true },
            None => Self { bytes: free, reason: "available", can_be_raised: false },
        }
    }

    fn refuse(&self, plan: &Plan, needed: u64) -> Error {
        let raise = if self.can_be_raised { "raise it, or use " } else { "use " };
        let sweep = if plan.settings().schedule == Schedule::Sweep { "" } else { ", the `algorithm` sweep" };
        let advice = format!("{raise}fewer `labels`{sweep} or smaller images");
        Error::OutOfMemory { needed, available: self.bytes, reason: self.reason, advice }
    }
}
