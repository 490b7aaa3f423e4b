//! `bp speed`: compares the speed of devices.

use harness::{
    measure::Asked,
    speed::{self, Files},
    threads,
};

use super::print;
use crate::{args::SpeedArgs, failure::Failure, interrupt, notes::note, terminal};

/// Runs the command.
pub(crate) fn speed(args: &SpeedArgs) -> Result<(), Failure> {
    let options = args.options();
    let files = options.output.as_deref().map(Files::new).transpose()?;
    interrupt::listen()?;
    let measure = || {
        terminal::watched(|watch| {
            let asked = Asked::open_all(&args.backend, watch)?;
            threads::check(args.threads, &args.backend, Asked::opened(&asked).map(|runner| runner.info.workers))?;
            files.as_ref().map_or(Ok(()), Files::check)?;
            speed::measure(&options, &asked, watch)
        })
    };
    let measured = threads::run_on(args.threads, measure)?;
    if let Some(files) = &files {
        note(&files.write(&measured)?);
    }
    print(&speed::page(&measured))?;
    Ok(speed::check(&measured)?)
}
