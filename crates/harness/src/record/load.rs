//! Reads records, which may be untrusted. No other code does. A loaded record fits the types and this program's schema.
//! Its strings are still whatever its author wrote, and no path in it has been followed.

use std::{borrow::Cow, fmt::Display, fs, path::Path};

use bp_io::Contents;
use serde::{Deserialize, de::DeserializeOwned};

use super::{
    Cell, Record, SCHEMA_VERSION,
    speed::{self, Speed},
};
use crate::{escape::printable, failure::Failure};

/// Name of the record in a run's folder.
pub const RECORD_FILE: &str = "record.json";

/// Name of the record of `bp speed` in a run's folder.
pub const SPEED_FILE: &str = "speed.json";

/// Name of the folder of disparity maps beside the record.
pub const MAPS_FOLDER: &str = "maps";

/// Larger files are not read. Our records are below 1 MiB, but an untrusted one may have any size.
const MAX_BYTES: u64 = 64 << 20;

/// The most characters shown of the reason for a refusal, which may quote an untrusted record at any length.
const MAX_MESSAGE: usize = 300;

/// The one field that every version of the schema has.
#[derive(Deserialize)]
struct Versioned {
    schema_version: u32,
}

/// Reads a record from its file, or from a run's folder.
pub fn load(path: &Path) -> Result<Record, Failure> {
    let path = record_file(path);
    parse(&path, &read(&path)?)
}

/// Parses the text of a record's file.
pub fn parse(path: &Path, text: &str) -> Result<Record, Failure> {
    let record: Record = versioned(path, text, &REPRODUCE)?;
    match record.cells.iter().filter_map(Cell::measured).find(|measured| !is_beside(&measured.map)) {
        Some(measured) => Err(refused(path, &REPRODUCE, &format!("a map outside of its folder: {}", measured.map))),
        None => Ok(record),
    }
}

/// Reads a record of `bp speed` from its file, or from a run's folder.
pub fn load_speed(path: &Path) -> Result<Speed, Failure> {
    let path: Cow<'_, Path> = if path.is_dir() { path.join(SPEED_FILE).into() } else { path.into() };
    versioned(&path, &read(&path)?, &SPEED)
}

/// A kind of record.
struct Kind {
    /// Its name in messages.
    what: &'static str,
    /// The version that this program reads.
    version: u32,
}

const REPRODUCE: Kind = Kind { what: "record of `bp reproduce` (see results/schema.json)", version: SCHEMA_VERSION };
const SPEED: Kind = Kind { what: "record of `bp speed`", version: speed::SCHEMA_VERSION };

fn refused(path: &Path, kind: &Kind, error: &dyn Display) -> Failure {
    // Backquotes mark names of options here, but names of fields in serde's messages.
    let why: String = printable(&error.to_string().replace('`', "\"")).chars().take(MAX_MESSAGE).collect();
    Failure::reading(path, &format!("not a {}: {why}", kind.what))
}

/// Parses a record, which must have the version that this program reads.
fn versioned<T: DeserializeOwned>(path: &Path, text: &str, kind: &Kind) -> Result<T, Failure> {
    // Check the version first, because another version may have other fields.
    let Versioned { schema_version } = serde_json::from_str(text).map_err(|error| refused(path, kind, &error))?;
    if schema_version != kind.version {
        let what = format!("schema version {schema_version}, this program reads {}", kind.version);
        return Err(Failure::reading(path, &format!("{what}; read it with the version of bp that wrote it")));
    }
    serde_json::from_str(text).map_err(|error| refused(path, kind, &error))
}

/// Whether a map lies in the maps folder. Reports show the map, and an untrusted record may name any file.
fn is_beside(map: &str) -> bool {
    let name = map.strip_prefix(MAPS_FOLDER).and_then(|rest| rest.strip_prefix('/'));
    name.is_some_and(|name| !name.is_empty() && !name.contains(['/', '\\']) && name != "..")
}

/// The file of a record, given the file or its folder.
pub fn record_file(path: &Path) -> Cow<'_, Path> {
    if path.is_dir() { path.join(RECORD_FILE).into() } else { path.into() }
}

/// The text of a regular file that is not too large.
fn read(path: &Path) -> Result<String, Failure> {
    let failed = |error: &dyn Display| Failure::reading(path, error);
    // Checked before opening, because opening a pipe waits for its other end.
    let about = fs::metadata(path).map_err(|error| failed(&error))?;
    if !about.is_file() {
        return Err(failed(&format!("not a file; name a {RECORD_FILE} or its folder")));
    }
    if about.len() > MAX_BYTES {
        return Err(failed(&format!("larger than {} MiB, so it is no record, and is not read", MAX_BYTES >> 20)));
    }
    // The file may have grown since, or the system may not report its size.
    let bytes = Contents::of(path, MAX_BYTES)?.bytes;
    String::from_utf8(bytes).map_err(|_| failed(&"not a text in UTF-8"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_they_were_written() {
        let text = "9.406865999999999";
        assert_eq!(serde_json::from_str::<f64>(text).unwrap().to_string(), text);
    }

    #[test]
    fn maps_lie_beside_their_record() {
        assert!(is_beside("maps/Baby1-bp.png"));
        for map in
            ["", "maps", "maps/", "maps/..", "maps/../../secret.png", "/etc/passwd", "mapsx/a.png", "maps/a/b.png"]
        {
            assert!(!is_beside(map), "{map}");
        }
    }
}
