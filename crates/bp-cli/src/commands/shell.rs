//! `bp completions` and `bp man`: write shell completions and man pages.

use std::{io::Write as _, path::Path};

use bp_io::{Files, create_folder};
use clap::{Command, CommandFactory as _};

use crate::{
    args::{Cli, CompletionsArgs, ManArgs},
    failure::Failure,
};

/// Prints a completion script.
pub(crate) fn completions(args: &CompletionsArgs) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "bp", &mut script);
    Ok(std::io::stdout().write_all(&script)?)
}

/// Writes a page for the program and one for each command.
pub(crate) fn man(args: &ManArgs) -> Result<(), Failure> {
    create_folder(&args.folder)?;
    let mut program = Cli::command();
    program.build();
    let is_written = |command: &&Command| command.get_name() != "help" && !command.is_hide_set();
    let commands = program.get_subcommands().filter(is_written);
    commands.cloned().try_for_each(|command| write_page(&args.folder, command))?;
    write_page(&args.folder, program)
}

fn write_page(folder: &Path, command: Command) -> Result<(), Failure> {
    let page = clap_mangen::Man::new(command);
    Ok(Files::default().whole(&folder.join(page.get_filename()), |file| page.render(file))?)
}
