//! What a match takes of memory, known before it begins, and how its plan is tiled to keep within.

use bp_core::{Error, Likeness, Plan, Schedule, Size, Tiling};

use crate::{args::MatchArgs, backends::Opened, failure::Failure, machine, note, warn};

/// What the program takes itself, with stacks of threads and what allocators keep.
const PROGRAM: u64 = 16 << 20;

/// Bytes a pixel of both images.
const PAIR: u64 = 6;

/// Bytes a pixel of known truth.
const TRUTH: u64 = 5;

/// Bytes a pixel of the map, and of what is made of it at a time to be written: most for a picture with a bar beside it.
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

/// How a plan is tiled, and what it takes.
pub(crate) struct Fitted {
    /// The tiles.
    pub(crate) tiling: Tiling,
    /// Most bytes that the program will hold at a time, predicted: images, tiles, answer and what is made of it.
    pub(crate) peak_bytes: u64,
}

/// How `plan` is tiled to keep within `--max-memory` and the memory that there is. Standard error tells where the image
/// is not matched as a whole. The plan itself stays what it is: tiles cost less accuracy than a smaller plan does.
pub(crate) fn fitted(args: &MatchArgs, plan: &Plan, opened: &Opened) -> Result<Fitted, Failure> {
    let beside = Beside::of(args, plan.image_size());
    let limit = Limit::of(args, opened, beside.held);
    let needed = |tile: &Plan| {
        opened.device.check(tile)?;
        // A whole image stays prepared while its answer is finished.
        let kept = if tile.image_size() == plan.image_size() { beside.finishing } else { 0 };
        Ok(opened.device.planned_bytes(tile).saturating_add(kept))
    };
    let room = limit.bytes.saturating_sub(beside.held + beside.coming);
    let tiling = match Tiling::within(plan, room, &needed) {
        Err(Error::OutOfMemory { needed, available, .. }) if available == Some(room) => {
            return Err(limit.refuse(plan, beside.peak(needed)));
        }
        tiling => tiling?,
    };
    let peak_bytes = beside.peak(tiling.bytes(&needed)?);
    if peak_bytes > limit.bytes {
        return Err(limit.refuse(plan, peak_bytes));
    }
    if !tiling.is_whole() {
        check_whole_options(args)?;
        let bytes = |bytes| format!("{} bytes are needed", beside.peak(bytes));
        let whole = needed(plan).map_or_else(|error| error.to_string(), bytes);
        let tell = if tiling.likeness() == Likeness::Same { note } else { warn };
        tell(&format!("for the whole image {whole}: matching {} in {peak_bytes} bytes", described(&tiling)));
    }
    Ok(Fitted { tiling, peak_bytes })
}

/// Refuses options that need all messages at once.
fn check_whole_options(args: &MatchArgs) -> Result<(), Failure> {
    let needing = [(args.messages_hash, "--messages-hash"), (args.many.warm_start.is_some(), "--warm-start")];
    let Some((_, option)) = needing.into_iter().find(|&(is_given, _)| is_given) else { return Ok(()) };
    let what = format!("{option} needs the whole image in memory at once");
    Err(Failure::out_of_memory(format!("{what}: leave it out, or allow more --max-memory")))
}

/// Bytes that are needed beside those of tiles.
struct Beside {
    /// Already now, and all the time.
    held: u64,
    /// Soon, and at any time from then on.
    coming: u64,
    /// Once the labels are there. Their energy needs less than what comes later.
    finishing: u64,
}

impl Beside {
    fn of(args: &MatchArgs, size: Size) -> Self {
        let a_pixel = |bytes: u64| bytes * size.pixels() as u64;
        let truth = if args.ground_truth.is_some() { TRUTH } else { 0 };
        let depth = if args.outputs.depth.is_some() { DEPTH } else { 0 };
        let finish = &args.finish;
        let right = if finish.needs_right() { RIGHT } else { 0 };
        let finishing = if finish.confidence.is_some() { CONFIDENCE } else { FINISHING };
        let finishing = finishing.max(if finish.speckle.is_some() { SPECKLE } else { 0 });
        // Of many pairs, the next one is read and the last one is written meanwhile; they count as this one's size.
        let trust = if finish.confidence.is_some() { TRUST } else { 0 };
        let others = if args.many.is_given() { READING + PAIR + MAP + trust + depth + WRITING } else { 0 };
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

/// What a tiling is, in words.
fn described(tiling: &Tiling) -> String {
    let ((columns, rows), size, answer) = (tiling.counts(), tiling.tile_size(), tiling.likeness().name());
    format!("{columns}x{rows} tiles of up to {size} pixels, which give {answer} (docs/big-images.md),")
}

/// How many bytes the program may hold.
struct Limit {
    bytes: u64,
    /// Who says so, up to advice.
    reason: String,
}

impl Limit {
    /// The lower one of `--max-memory` and, unless the device has memory of its own, of what is held and what is free.
    fn of(args: &MatchArgs, opened: &Opened, held: u64) -> Self {
        let there_is = machine::available_memory(opened.info.kind).map_or(u64::MAX, |free| free.saturating_add(held));
        match args.max_memory.map(|allowed| allowed.as_u64()).filter(|&allowed| allowed <= there_is) {
            Some(bytes) => Self { bytes, reason: format!("--max-memory allows {bytes}: raise it, or") },
            None => Self { bytes: there_is, reason: format!("there are {there_is}:") },
        }
    }

    fn refuse(&self, plan: &Plan, needed: u64) -> Failure {
        let sweep = if plan.settings().schedule == Schedule::Sweep { "" } else { ", --algorithm sweep" };
        let advice = format!("fewer --labels{sweep} or smaller images need less");
        Failure::out_of_memory(format!("at least {needed} bytes are needed and {} {advice}", self.reason))
    }
}
