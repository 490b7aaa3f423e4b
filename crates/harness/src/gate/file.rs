//! Baseline files: JSON with a version, written whole.

use std::path::Path;

use bp_io::read_text;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::{
    failure::Failure,
    files::{create_folder, write_json},
};

/// The file of the instruction counts; all others in its folder are baselines of speed-ups.
pub(super) const INSTRUCTIONS: &str = "instructions.json";

/// Version of the files; changes with every change of meaning.
const SCHEMA_VERSION: u32 = 1;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Versioned<T> {
    schema_version: u32,
    baseline: T,
}

/// The one field that every version has.
#[derive(Deserialize)]
struct Version {
    schema_version: u32,
}

/// Reads a file; `None` if it does not exist.
pub(super) fn read<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, Failure> {
    if !path.exists() {
        return Ok(None);
    }
    parse(path, &read_text(path)?).map(Some)
}

/// Parses the text of a baseline file.
pub(super) fn parse<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, Failure> {
    // Backquotes mark names of options here, but names of fields in serde's messages.
    let failed = |error: serde_json::Error| Failure::reading(path, &error.to_string().replace('`', "\""));
    // The version is checked first, because other versions may have other fields.
    let Version { schema_version } = serde_json::from_str(text).map_err(failed)?;
    if schema_version != SCHEMA_VERSION {
        let what = format!("version {schema_version} of baselines, this program has {SCHEMA_VERSION}");
        return Err(Failure::reading(path, &format!("{what}; delete it, and make it anew by --update")));
    }
    let file: Versioned<T> = serde_json::from_str(text).map_err(failed)?;
    Ok(file.baseline)
}

/// Writes a file, and creates its folder if that is missing.
pub(super) fn write(path: &Path, baseline: &impl Serialize) -> Result<(), Failure> {
    create_folder(path.parent().unwrap_or(Path::new(".")))?;
    let file = Versioned { schema_version: SCHEMA_VERSION, baseline };
    write_json(path, &file)
}
