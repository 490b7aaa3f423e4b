//! `bp conform`: checks that backends give the same answers as the reference, to the bit.

use std::{io::Write, time::Instant};

use bp_core::{Device, Error, IsStopped, Plan, Solver};
use bp_stereo::devices;

use crate::{args::ConformArgs, failure::Failure, interrupt, notes::tell, terminal};

/// A device that refuses plans once the user wants to stop, so that the suite ends between two cases.
struct Stoppable<'a>(&'a dyn Device);

impl Device for Stoppable<'_> {
    fn prepare(&self, plan: &Plan, _: IsStopped<'_>) -> Result<Box<dyn Solver>, Error> {
        let is_stopped = || terminal::watch().is_stopped();
        if is_stopped() { Err(Error::Stopped) } else { self.0.prepare(plan, &is_stopped) }
    }

    fn check(&self, plan: &Plan) -> Result<(), Error> {
        self.0.check(plan)
    }

    fn check_warm(&self, plan: &Plan) -> Result<(), Error> {
        self.0.check_warm(plan)
    }

    fn planned_bytes(&self, plan: &Plan) -> u64 {
        self.0.planned_bytes(plan)
    }

    fn likely_bytes(&self, plan: &Plan) -> u64 {
        self.0.likely_bytes(plan)
    }
}

/// Runs the command. If a backend fails, the others are still checked.
pub(crate) fn conform(args: &ConformArgs) -> Result<(), Failure> {
    interrupt::listen()?;
    let chosen: Vec<_> =
        args.backend.iter().map(|name| Ok(devices::choose(name, None)?)).collect::<Result<_, Failure>>()?;
    let mut failures = Vec::new();
    for chosen in chosen {
        let name = chosen.name.clone();
        let opened = chosen.open().map_err(|error| Failure::unavailable(devices::reason(error)));
        let outcome = opened.and_then(|opened| check(&opened, args.every.get()));
        terminal::watch().check()?;
        failures.extend(outcome.err().map(|failure| (name, failure)));
    }
    let Some((name, failure)) = failures.pop() else { return Ok(()) };
    failures.iter().for_each(|(name, failure)| tell(&format!("bp: {name}: {failure}")));
    Err(failure.of(&name))
}

/// Runs every n-th case of the suite on a device.
fn check(opened: &devices::Opened, n: usize) -> Result<(), Failure> {
    let reference = devices::reference()?;
    let start = Instant::now();
    let conforms = bp_testkit::conform_every(n, reference.device.as_ref(), &Stoppable(opened.device.as_ref()));
    conforms.map_err(|difference| Failure::other(difference.to_string()))?;
    let (cases, seconds) = (bp_testkit::cases().step_by(n).count(), start.elapsed().as_secs_f64());
    let what = format!("{cases} cases match {} to the bit, also after another pair", reference.name);
    writeln!(std::io::stdout(), "{}: {what}, in {seconds:.1} s on {}", opened.name, opened.info.name)?;
    Ok(())
}
