//! `bp scenes`: lists the scenes and checks their files.

use std::io::Write;

use bp_testkit::synthetic;

use harness::scenes::{Manifest, Source};

use crate::{args::ScenesArgs, failure::Failure, notes::printable};

/// Runs the command. Lists the synthetic scenes, or checks every listed file that the data folder holds.
pub(crate) fn scenes(args: &ScenesArgs) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    let source = Source::new(args.data.folder(), false)?;
    let Some(folder) = source.folder() else {
        writeln!(out, "{}:", source.set.described)?;
        for (name, [width, height]) in synthetic::NAMES.iter().zip(synthetic::SIZES) {
            writeln!(out, "  {name:<12}{width}x{height}, {} labels", source.set.labels)?;
        }
        return Ok(());
    };
    let manifest = Manifest::read()?;
    let (mut found, mut wrong) = (0, 0);
    for entry in manifest.files.iter().filter(|entry| folder.join(&entry.path).exists()) {
        let checked = manifest.checked(folder, &folder.join(&entry.path));
        found += 1;
        wrong += u32::from(checked.is_err());
        let state = checked.err().map_or_else(|| "as listed".to_owned(), |failure| failure.to_string());
        writeln!(out, "{:<60}{}", entry.path, printable(&state))?;
    }
    let listed = manifest.files.len();
    writeln!(out, "{found} of {listed} listed files found, {wrong} wrong")?;
    match (found, wrong) {
        (0, _) => Err(Failure::input(format!("--data {}: none of the listed files was found", folder.display()))),
        (_, 0) => Ok(()),
        _ => Err(Failure::input(format!("{wrong} files differ from the list"))),
    }
}
