//! Sidecars: JSON files beside maps, with the information that the map's format cannot hold.

use std::{
    io::ErrorKind,
    path::{Path, PathBuf},
};

use bp_core::Calibration;
use serde::Serialize;
use serde_json::Value;

use crate::{
    Colours, Contents, Error, Files, MapFormat, Raster, Staged, folders::sync_folder_of, read::MOST_DESCRIPTION,
    write::Hidden,
};

/// Version of the sidecar's format. Every change of meaning raises it.
const SCHEMA_VERSION: u32 = 1;

/// The name of the program in the sidecar, before its version.
const PROGRAM: &str = "bp ";

/// The sidecar's path: the map's path with `.json` appended.
#[must_use]
pub fn sidecar_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".json");
    name.into()
}

/// What the sidecar of a map says of it.
pub(crate) struct Told {
    pub(crate) quantity: String,
    /// If the map holds the negative of each value: the range of values in it, if any is known.
    pub(crate) negated: Option<Option<[f32; 2]>>,
}

/// What a map's sidecar says; `None` if there is no sidecar of this program. Fails if one cannot be read.
pub(crate) fn told(path: &Path) -> Result<Option<Told>, Error> {
    let path = sidecar_of(path);
    match path.metadata() {
        Ok(about) if about.is_file() && about.len() <= MOST_DESCRIPTION => {}
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(Error::reading(&path, &error)),
        _ => return Ok(None),
    }
    let bytes = Contents::of(&path, MOST_DESCRIPTION)?.bytes;
    let told = || -> Option<Told> {
        let sidecar: Value = serde_json::from_slice(&bytes).ok()?;
        let is_own = sidecar.get("program")?.as_str()?.starts_with(PROGRAM);
        let quantity = sidecar.get("quantity").filter(|_| is_own)?.as_str()?.to_owned();
        let is_negated = sidecar.get("scale").and_then(Value::as_f64).is_some_and(|scale| scale < 0.0);
        let found = |end: &str| sidecar.get("found")?.get(end)?.as_f64().map(|value| value as f32);
        let range = found("min").zip(found("max")).map(|(min, max)| [min, max]);
        Some(Told { quantity, negated: is_negated.then_some(range) })
    };
    Ok(told())
}

/// Puts a map or picture at its place, `path`, and its sidecar, if it gets one. At every moment the map is whole, the old one or
/// the new one, and a sidecar, if there is one, is that of the map. If the map cannot be put there, both stay as they were.
///
/// # Errors
/// [`Error::Write`].
pub fn put_described(files: &Files, path: &Path, map: Staged, sidecar: Option<Staged>) -> Result<(), Error> {
    // Not another program's file of that name. Where the sidecar is a link, the link stays.
    let old = told(path)?.map(|_| files.hide(&sidecar_of(path))).transpose()?;
    let place = match map.moved() {
        Ok(place) => place,
        Err(error) => {
            old.into_iter().for_each(Hidden::restore);
            return Err(error);
        }
    };
    // From here on the old sidecar would be that of another map, also if the disk fails.
    drop(old);
    place.map_or(Ok(()), |place| sync_folder_of(&place))?;
    sidecar.map_or(Ok(()), Staged::put)
}

/// The origin of a map.
#[derive(Clone, Copy, Debug)]
pub struct Origin<'a, P> {
    /// The plan of the match, if the map comes from one.
    pub plan: Option<&'a P>,
    /// Disparities of the first and the last label in pixels, if the map comes from a match.
    pub labels: Option<[i64; 2]>,
    /// The calibration, for depths.
    pub calibration: Option<&'a Calibration>,
    /// The files that the map was made from.
    pub inputs: &'a [&'a Path],
}

/// The contents of a sidecar. A value is `stored * scale + offset`.
#[derive(Serialize)]
struct Sidecar<'a, P> {
    schema_version: u32,
    program: String,
    quantity: &'static str,
    unit: &'static str,
    format: &'static str,
    scale: f64,
    offset: f64,
    unknown: Unknown,
    /// For a picture, the colour map, whose positions from 0 to 1 are the stored values.
    colours: Option<&'static str>,
    width: usize,
    height: usize,
    /// Disparities of the first and the last label, in pixels.
    labels: Option<Range<i64>>,
    /// The least and the largest known value, in `unit`; `None` if no pixel is known.
    found: Option<Range<f32>>,
    calibration: Option<Geometry>,
    plan: Option<&'a P>,
    inputs: Vec<String>,
}

/// The stored value of unknown pixels. Infinity and NaN are text, because JSON has no numbers for them.
#[derive(Serialize)]
#[serde(untagged)]
enum Unknown {
    Number(u16),
    Text(&'static str),
}

#[derive(Serialize)]
struct Range<T> {
    min: T,
    max: T,
}

#[derive(Serialize)]
struct Geometry {
    focal_px: f64,
    baseline_mm: f64,
    doffs_px: f64,
    principal_point_px: [f64; 2],
}

impl From<&Calibration> for Geometry {
    fn from(calibration: &Calibration) -> Self {
        Self {
            focal_px: calibration.focal(),
            baseline_mm: calibration.baseline(),
            doffs_px: calibration.doffs(),
            principal_point_px: calibration.principal_point(),
        }
    }
}

/// How values are stored.
struct Stored {
    format: &'static str,
    scale: f64,
    offset: f64,
    unknown: Unknown,
    colours: Option<&'static str>,
}

/// Writes the sidecar of a map that goes to `path`, up to its last step, see [`Files::staged`].
///
/// # Errors
/// [`Error::Write`].
pub fn staged_sidecar<P: Serialize>(
    files: &Files,
    path: &Path,
    raster: &Raster<'_>,
    origin: &Origin<'_, P>,
) -> Result<Staged, Error> {
    let format = MapFormat::of(path)?;
    let (scale, unknown) = match format {
        MapFormat::Png16 => (1.0 / f64::from(raster.quantity.steps()), Unknown::Number(0)),
        _ if raster.has_nan(format) => (1.0, Unknown::Text("nan")),
        MapFormat::Pfm | MapFormat::Tiff | MapFormat::Npy => (1.0, Unknown::Text("inf")),
    };
    let scale = f64::from(raster.sign()) * scale;
    staged(files, path, raster, origin, Stored { format: format.name(), scale, offset: 0.0, unknown, colours: None })
}

/// [`staged_sidecar`] of a map's coloured picture. Stored values are positions in the colour map, from 0 to 1.
///
/// # Errors
/// [`Error::Write`].
pub fn staged_picture_sidecar<P: Serialize>(
    files: &Files,
    path: &Path,
    raster: &Raster<'_>,
    colours: Colours,
    origin: &Origin<'_, P>,
) -> Result<Staged, Error> {
    let (low, high) = raster.range().map_or((0.0, 1.0), |(low, high)| (f64::from(low), f64::from(high)));
    let (unknown, colours) = (Unknown::Text("black"), Some(colours.name()));
    let stored = Stored { format: "coloured PNG", scale: high - low, offset: low, unknown, colours };
    staged(files, path, raster, origin, stored)
}

fn staged<P: Serialize>(
    files: &Files,
    path: &Path,
    raster: &Raster<'_>,
    origin: &Origin<'_, P>,
    stored: Stored,
) -> Result<Staged, Error> {
    let sidecar = Sidecar {
        schema_version: SCHEMA_VERSION,
        program: format!("{PROGRAM}{}", env!("CARGO_PKG_VERSION")),
        quantity: raster.quantity.name(),
        unit: raster.quantity.unit(),
        format: stored.format,
        scale: stored.scale,
        offset: stored.offset,
        unknown: stored.unknown,
        colours: stored.colours,
        width: raster.size.width,
        height: raster.size.height,
        labels: origin.labels.map(|[min, max]| Range { min, max }),
        found: raster.range().map(|(min, max)| Range { min, max }),
        calibration: origin.calibration.map(Into::into),
        plan: origin.plan,
        inputs: origin.inputs.iter().map(|path| path.display().to_string()).collect(),
    };
    files.staged_json(&sidecar_of(path), &sidecar)
}
