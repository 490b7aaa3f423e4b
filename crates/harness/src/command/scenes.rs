//! `bp scenes`: what there is to run on.

use std::io::Write;

use bp_core::synthetic;

use crate::{
    args::ScenesArgs,
    failure::Failure,
    scenes::{Manifest, Source},
};

/// Runs the command: lists the scenes, and checks every listed file that the data folder holds.
pub(crate) fn scenes(args: &ScenesArgs) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    let source = Source::new(&args.data, false)?;
    let Some(folder) = source.folder() else {
        writeln!(out, "{}:", Source::describe(source.name))?;
        for (name, [width, height]) in synthetic::NAMES.iter().zip(synthetic::SIZES) {
            writeln!(out, "  {name:<12}{width}x{height}, {} labels", source.labels)?;
        }
        return Ok(());
    };
    let manifest = Manifest::read()?;
    let (mut wrong, mut missing) = (0, 0);
    for entry in &manifest.files {
        let path = folder.join(&entry.path);
        let state = if !path.exists() {
            missing += 1;
            "missing".to_owned()
        } else if let Err(failure) = manifest.checked(folder, &path) {
            wrong += 1;
            failure.to_string()
        } else {
            "as listed".to_owned()
        };
        writeln!(out, "{:<60}{state}", entry.path)?;
    }
    let listed = manifest.files.len();
    writeln!(out, "{listed} files listed, {missing} missing, {wrong} wrong")?;
    if wrong > 0 { Err(Failure::input(format!("{wrong} files are not as listed"))) } else { Ok(()) }
}
