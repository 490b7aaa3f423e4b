//! Predicts the memory that a match needs, and tiles its plan to stay within a limit.

use bp_core::{
    Energy, Image, Plan, Profile, Schedule, Size, StereoPair, Tiling,
    finish::{self, Finish},
    image::Samples,
};

use crate::{Error, Options, Watch, devices::Opened, error::iec, rectifying::POSITIONS, system::Memory, tiles::ANSWER};

/// Bytes of the program itself, the stacks of its threads and the reserves of its allocators, which vary by more than 2 MiB.
pub(crate) const PROGRAM: u64 = 25 << 20;

/// About the bytes that allocators keep of freed memory where the caller does not limit memory.
const KEPT: u64 = 32 << 20;

/// Bytes per pixel of the ground truth.
const TRUTH: u64 = 5;

/// Byte per pixel that tells whether it is valid.
const VALID: u64 = 1;

/// Bytes per pixel of the map, and of the largest output made from it: a picture with a colour bar.
const MAP: u64 = 4;
const WRITING: u64 = 8;

/// Bytes per pixel of the labels, which are kept until the map is written.
const LABELS: u64 = 2;

/// Bytes per pixel of a pair that is read while another is matched: one image, and the other as a file, decoded and
/// copied.
const READING: u64 = Image::COLOUR_BYTES + 9;

/// The same if values are stretched: both images as floats in three channels, and one of them in colour with its shades.
const STRETCHING: u64 = 6 * Samples::VALUE_BYTES + 2 * Image::COLOUR_BYTES + 1;

/// Bytes per pixel of the confidence.
const TRUST: u64 = 4;

/// Bytes per pixel of the depths.
const DEPTH: u64 = 4;

/// Bytes per pixel of the map of the right image.
const RIGHT_MAP: u64 = 4;

/// Temporary bytes per pixel for finishing a map: the next map and, for the confidence, both maps and the worth of each pixel.
const FINISHING: u64 = 4;
const CONFIDENCE: u64 = 12;

/// Rows and columns of the frames around maps that are filtered, on both sides together.
const FRAME: usize = 8;

/// What the program holds in memory beside the matcher, so that a memory limit includes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Beside {
    /// Whether ground truth is in memory.
    pub truth: bool,
    /// Whether a mask says which pixels are valid.
    pub masked: bool,
    /// Whether depths are made from the map.
    pub depth: bool,
    /// Whether a [`Rectifying`](crate::Rectifying) is kept for further pairs.
    pub rectified: bool,
    /// Whether the next pair is read and the previous one written at the same time.
    pub batch: bool,
    /// The bytes that a batch holds of all its pairs.
    pub listed: u64,
    /// The option that needs all messages at once, if any. The image then cannot be tiled.
    pub whole: Option<&'static str>,
}

/// The images of a pair in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Images {
    /// The bytes of both.
    bytes: u64,
    /// Bytes per pixel of what is compared of one of them.
    compared: u64,
    /// Whether there is an aligned image too.
    is_aligned: bool,
}

impl Images {
    pub(crate) fn of(pair: &StereoPair, profile: Profile, is_aligned: bool) -> Self {
        Self { bytes: pair.bytes(), compared: profile.image_bytes(), is_aligned }
    }
}

/// The tiling of a plan, and the memory it needs.
pub(crate) struct Fitted {
    /// The tiles.
    pub(crate) tiling: Tiling,
    /// Predicted peak memory of the program in bytes: images, tiles, the answer and the outputs made from it.
    pub(crate) peak_bytes: u64,
}

/// Tiles `plan` to stay within the options' limit and the available memory. Reports to `watch` if the image is not
/// matched as a whole. The plan itself does not change, because tiles cost less accuracy than a smaller plan.
pub(crate) fn fitted(
    options: &Options,
    beside: Beside,
    plan: &Plan,
    images: Images,
    opened: &Opened,
    watch: &Watch<'_>,
) -> Result<Fitted, Error> {
    let bytes = Bytes::beside(options, beside, images, plan.image_size());
    let limit = Limit::of(options, opened, bytes.held);
    let needed = |tile: &Plan| {
        opened.device.check(tile)?;
        // A whole image stays prepared while its answer is finished.
        let kept = if tile.image_size() == plan.image_size() { bytes.finishing } else { 0 };
        Ok(opened.device.planned_bytes(tile).saturating_add(kept))
    };
    let room = limit.bytes.saturating_sub(bytes.held + bytes.coming);
    let likely = |tile: &Plan| {
        opened.device.check(tile)?;
        Ok(opened.device.likely_bytes(tile))
    };
    let tiling = match Tiling::within(plan, room, &needed, &likely) {
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
        watch.warn(&text);
    }
    Ok(Fitted { tiling, peak_bytes })
}

/// Refuses tiles if an option needs all messages at once.
fn check_whole(beside: Beside, needed: &Result<u64, bp_core::Error>, available: u64) -> Result<(), Error> {
    let Some(option) = beside.whole else { return Ok(()) };
    let needed = needed.clone()?;
    let advice = format!("`{option}` needs the whole image in memory at once: leave it out, or raise `max_memory`");
    Err(Error::OutOfMemory { needed, available, reason: "there for the whole image", advice })
}

/// Bytes beside those of the tiles.
struct Bytes {
    /// Held now and throughout the match.
    held: u64,
    /// Allocated later and then held, or reserved, until the end.
    coming: u64,
    /// Held once the labels are selected.
    finishing: u64,
}

impl Bytes {
    fn beside(options: &Options, beside: Beside, images: Images, size: Size) -> Self {
        let a_pixel = |bytes: u64| bytes * size.pixels() as u64;
        let if_so = |is_so: bool, bytes: u64| if is_so { bytes } else { 0 };
        let (truth, depth) = (if_so(beside.truth, TRUTH), if_so(beside.depth, DEPTH));
        let valid = if_so(beside.masked || options.stretch, VALID);
        let (aligned, positions) = (if_so(images.is_aligned, images.compared), if_so(beside.rectified, POSITIONS));
        // The mirrored pair while the right image is matched, and its map after that.
        let right = if_so(options.needs_right(), RIGHT_MAP.max(2 * images.compared));
        let trust = if_so(options.confidence, TRUST);
        let reading = if options.stretch { STRETCHING } else { READING };
        // Assumes that the next and the previous pair of a batch have the same size as this one.
        let others = if_so(beside.batch, reading + 2 * Image::COLOUR_BYTES + MAP + trust + depth + WRITING);
        Self {
            held: PROGRAM + beside.listed + images.bytes + a_pixel(aligned + positions + truth + valid),
            coming: a_pixel(right + others),
            finishing: a_pixel(MAP) + a_pixel(WRITING + depth).max(a_pixel(LABELS) + finishing(options, size)),
        }
    }

    /// The peak memory in bytes, if the tiles need `tiles` bytes.
    fn peak(&self, tiles: u64) -> u64 {
        (self.held + self.coming).saturating_add(tiles.max(self.finishing))
    }
}

/// Temporary bytes for finishing a map of this size, and for its energy, on the threads of the current pool.
fn finishing(options: &Options, size: Size) -> u64 {
    let a_pixel = |bytes: u64| bytes * size.pixels() as u64;
    let framed = MAP * ((size.width + FRAME) * (size.height + FRAME)) as u64;
    let filtered = a_pixel(FINISHING) + framed;
    let refined = a_pixel(FINISHING) + finish::window_bytes(size, rayon::current_num_threads());
    let trusted = if options.confidence { a_pixel(CONFIDENCE) + 2 * framed } else { 0 };
    let Finish { unique, speckles, subpixel, .. } = options.finish();
    let speckles = if unique || speckles.is_some() { finish::speckle_bytes(size) } else { 0 };
    let refined = if subpixel || unique { refined } else { 0 };
    let judged = if options.energy { Energy::temporary_bytes(size, rayon::current_num_threads()) } else { 0 };
    filtered.max(refined).max(judged).max(trusted).max(speckles)
}

/// A tiling in words.
fn described(tiling: &Tiling) -> String {
    let ((columns, rows), size) = (tiling.counts(), tiling.tile_size());
    format!("{columns}x{rows} tiles of up to {size} pixels, which give {ANSWER} (docs/big-images.md),")
}

/// How many bytes the program may hold.
struct Limit {
    bytes: u64,
    /// The source of the limit, for messages.
    reason: &'static str,
    /// Whether the caller could allow more.
    can_be_raised: bool,
}

impl Limit {
    /// The lower of `max_memory` and the memory that is held or free. Without `max_memory`, what allocators keep is left free. The
    /// free memory counts only if the device has none of its own.
    fn of(options: &Options, opened: &Opened, held: u64) -> Self {
        let free = Memory::available_to(opened.info.kind).map_or(u64::MAX, |free| free.saturating_add(held));
        match options.max_memory {
            Some(bytes) if bytes <= free => Self { bytes, reason: "allowed by `max_memory`", can_be_raised: true },
            Some(_) => Self { bytes: free, reason: "available", can_be_raised: false },
            None => Self { bytes: free.saturating_sub(KEPT), reason: "available", can_be_raised: false },
        }
    }

    fn refuse(&self, plan: &Plan, needed: u64) -> Error {
        let raise = if self.can_be_raised { "raise it, or use " } else { "use " };
        let sweep = if plan.settings().schedule == Schedule::Sweep { "" } else { ", the `algorithm` sweep" };
        let advice = format!("{raise}fewer `labels`{sweep} or smaller images");
        Error::OutOfMemory { needed, available: self.bytes, reason: self.reason, advice }
    }
}
