//! Tiny pairs with arbitrary settings, drawn from bytes.

use arbitrary::Unstructured;
use bp_core::{
    Algorithm, Alignment, Backend, Calibration, Cut, Device, DisparityMap, Energy, Error, Image, MAX_GRIDS,
    MAX_TRUNCATION, MessageStart, Model, Plan, Profile, Schedule, Settings, Size, StereoPair, Tiled, Tiling, depth_map,
    finish::{Finish, MEDIANS, confidence},
    never,
    survey::Survey,
};
use bp_cpu_rayon::Rayon;
use bp_cpu_scalar::Scalar;
use bp_testkit::{Case, compare, solve};

/// Maximum number of data costs of a pair. It allows hundreds of matches per second, although the fuzzer watches every
/// comparison.
const VOLUME: usize = 4096;

/// Size of [`map`].
pub(super) const MAP: Size = Size { width: 6, height: 1 };

/// Disparities of all sorts.
pub(super) fn map() -> DisparityMap {
    let values = vec![0.0, 0.5, -3.0, 300.0, 1e30, DisparityMap::UNKNOWN];
    DisparityMap::new(MAP, values).unwrap_or_else(|error| panic!("{error}"))
}

/// Everything that is drawn from the bytes.
struct Drawn {
    case: Case,
    finish: Finish,
    /// Columns and rows that tiles keep, and their halo.
    tile: (Size, usize),
    /// Bytes that a tiling may take.
    memory: u64,
    /// Index of the instruction set.
    level: usize,
}

/// Draws everything and runs it; returns whether the settings make a valid plan.
pub(super) fn run(bytes: &[u8]) -> bool {
    let Ok(Some(drawn)) = draw(Unstructured::new(bytes)) else { return false };
    let fast = Rayon.open(drawn.level % Rayon.devices().len());
    let [slow, fast] = [Scalar.open(0), fast].map(|device| device.unwrap_or_else(|error| panic!("{error}")));
    let devices = [slow.as_ref(), fast.as_ref()];
    if let Err(error) = all(&drawn, devices) {
        panic!("{error}\n{:?}", drawn.case.plan);
    }
    true
}

fn all(drawn: &Drawn, devices: [&dyn Device; 2]) -> Result<(), Error> {
    let Drawn { case: Case { pair, plan }, tile, memory, .. } = drawn;
    let mirrored = Case { pair: pair.mirrored(), plan: plan.clone() };
    let [slow, fast] = devices;
    for case in [&drawn.case, &mirrored] {
        compare(slow, fast, case).unwrap_or_else(|difference| panic!("{difference}"));
    }
    let [left, right] = [solve(fast, &drawn.case)?.labels, solve(fast, &mirrored)?.labels];
    let energy = Energy::of(pair, plan.model(), &left)?;
    assert!(energy.total() <= most(plan), "{energy:?}");
    let needed = |plan: &Plan| Ok(fast.planned_bytes(plan));
    let likely = |plan: &Plan| Ok(fast.likely_bytes(plan));
    let tilings = [Ok(Tiling::cut(plan.clone(), tile.0, tile.1)), Tiling::within(plan, *memory, &needed, &likely)];
    tilings.into_iter().flatten().try_for_each(|tiling| tiles(&tiling, pair, &left, devices))?;
    let map = |labels: &[u16]| DisparityMap::from_labels(pair.size(), plan.model(), labels);
    finished(drawn.finish, pair, map(&left)?, &map(&right)?.mirrored())?;
    surveyed(pair)
}

/// Upper bound of a plan's energy.
fn most(plan: &Plan) -> u64 {
    let (pixels, model) = (plan.image_size().pixels() as u64, plan.model());
    pixels * (u64::from(model.profile().max_cost()) + 2 * u64::from(model.truncation()))
}

/// Checks that devices give the same labels for a tiling, and those of the whole image if the tiling promises them.
fn tiles(tiling: &Tiling, pair: &StereoPair, whole: &[u16], devices: [&dyn Device; 2]) -> Result<(), Error> {
    let labels = devices.map(|device| {
        let mut tiled = Tiled::new(device, tiling.clone())?;
        tiled.solve(device, pair)?;
        Ok(tiled.labels().to_vec())
    });
    let [slow, fast] = labels;
    let fast = fast?;
    assert!(slow? == fast, "backends differ in {tiling:?}");
    assert!(!tiling.is_whole() || fast == whole, "other labels than the whole's in {tiling:?}");
    Ok(())
}

/// Checks that finishing a map keeps its size and range.
fn finished(finish: Finish, pair: &StereoPair, left: DisparityMap, right: &DisparityMap) -> Result<(), Error> {
    let trust = confidence(&left, right, &never)?;
    assert!(trust.len() == left.size().pixels() && trust.iter().all(|share| (0.0..=1.0).contains(share)), "{trust:?}");
    let (size, range) = (left.size(), left.range());
    let map = finish.apply(pair, left, Some(right), &never)?;
    let inside = |value: f32| range.is_some_and(|(low, high)| (low..=high).contains(&value));
    assert!(map.size() == size && map.values().iter().all(|&v| v == DisparityMap::UNKNOWN || inside(v)), "{map:?}");
    let calibration = Calibration::new(500.0, 60.0, 3.0, [1.0, 2.0])?;
    assert!(depth_map(&map, &calibration).iter().all(|&depth| depth > 0.0), "{map:?}");
    Ok(())
}

/// Checks that the labels that a survey proposes make a valid model, and that the rows it finds can be aligned.
fn surveyed(pair: &StereoPair) -> Result<(), Error> {
    let survey = Survey::of(pair)?;
    assert!((0.0..=1.0).contains(&survey.matched), "{survey:?}");
    if let Some(seen) = survey.seen {
        let range = seen.range();
        Model::new(Profile::Census, range.labels)?.with_min_disparity(range.min_disparity)?;
    }
    Alignment::find(pair, &survey).map_or(Ok(()), |alignment| alignment.aligned(pair).map(drop))
}

fn draw(mut from: Unstructured<'_>) -> arbitrary::Result<Option<Drawn>> {
    let size = size(&mut from)?;
    let (model, settings) = (model(&mut from, size)?, settings(&mut from, size)?);
    let finish = finish(&mut from)?;
    let kept = Size { width: from.int_in_range(1..=70)?, height: from.int_in_range(1..=70)? };
    let tile = (kept, from.int_in_range(0..=40)?);
    let (memory, level) = (from.arbitrary::<u16>()?.into(), from.int_in_range(0..=3)?);
    let plan = model.and_then(|model| Plan::new(size, model, settings));
    let pair = pair(size, from.take_rest()).ok();
    Ok(pair.zip(plan.ok()).map(|(pair, plan)| Drawn { case: Case { pair, plan }, finish, tile, memory, level }))
}

/// Up to 24 pixels a side; sometimes a ribbon that can be cut into several tiles.
fn size(from: &mut Unstructured<'_>) -> arbitrary::Result<Size> {
    let [long, short] = [from.int_in_range(1..=24)?, from.int_in_range(1..=24)?];
    let ribbon = (8 * long, short.min(3));
    let (width, height) = match from.int_in_range(0..=7)? {
        0 => ribbon,
        1 => (ribbon.1, ribbon.0),
        _ => (long, short),
    };
    Ok(Size { width, height })
}

fn model(from: &mut Unstructured<'_>, size: Size) -> arbitrary::Result<Result<Model, Error>> {
    let profile = *from.choose(&Profile::ALL)?;
    let many = *from.choose(&[63, 64, 65, 129, 300, 1024])?;
    let labels = if from.ratio(1, 8)? { many } else { from.int_in_range(1..=33)? };
    let min_disparity = match from.int_in_range(0..=15)? {
        0 => 1 << 24,
        1 => -(1 << 24),
        _ => from.int_in_range(-40..=60)?,
    };
    let (slope, truncation) = (from.arbitrary()?, from.int_in_range(0..=MAX_TRUNCATION)?);
    let threshold: Option<u8> = from.arbitrary()?;
    let model = Model::new(profile, labels.min(VOLUME / size.pixels()).max(1));
    let model = model.and_then(|model| model.with_min_disparity(min_disparity)?.with_smoothness(slope, truncation));
    Ok(model.map(|model| threshold.map_or(model, |threshold| model.with_edges_halved_above(threshold))))
}

fn settings(from: &mut Unstructured<'_>, size: Size) -> arbitrary::Result<Settings> {
    let schedule = *from.choose(&Schedule::ALL)?;
    if from.arbitrary()? {
        let (k, z) = (from.int_in_range(0..=12)?, from.int_in_range(0..=4)?);
        return Ok(from.choose(&Algorithm::ALL)?.settings(size, k, z, schedule));
    }
    let [x, y] = [from.int_in_range(0..=size.width)?, from.int_in_range(0..=size.height)?];
    let cut = Cut { x, y, seed_start: from.arbitrary()? };
    let is_cut = from.ratio(1, 4)?;
    Ok(Settings {
        grids: if from.ratio(1, 16)? { MAX_GRIDS + 1 } else { from.int_in_range(0..=6)? },
        steps: from.int_in_range(0..=5)?,
        schedule,
        message_start: *from.choose(&MessageStart::ALL)?,
        cut: is_cut.then_some(cut),
        coarse_clip: from.arbitrary()?,
        label_sets: from.arbitrary()?,
    })
}

fn finish(from: &mut Unstructured<'_>) -> arbitrary::Result<Finish> {
    let median = *from.choose(&MEDIANS)?;
    Ok(Finish {
        check: from.arbitrary()?,
        unique: from.arbitrary()?,
        speckles: from.arbitrary::<Option<u8>>()?.map(usize::from),
        fill: from.arbitrary()?,
        median: from.arbitrary::<bool>()?.then_some(median),
        subpixel: from.arbitrary()?,
    })
}

/// Both images repeat the remaining bytes. The right one continues where the left one ends.
fn pair(size: Size, bytes: &[u8]) -> Result<StereoPair, Error> {
    let mut values = bytes.iter().chain([&0]).copied().cycle();
    let mut pixels = |_| std::array::from_fn(|_| values.next().unwrap_or(0));
    let mut image = || Image::from_rgb(size.width, size.height, (0..size.pixels()).map(&mut pixels).collect());
    StereoPair::new(image()?, image()?)
}
