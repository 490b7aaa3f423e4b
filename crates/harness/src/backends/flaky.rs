//! A backend for tests, whose device is lost again and again.

use std::sync::atomic::{AtomicUsize, Ordering};

use bp_core::{Backend, Device, DeviceInfo, Error, IsStopped, Plan, Solver};

use super::Opened;

/// Its device solves one problem, and is lost until it is opened again.
#[derive(Default)]
pub(crate) struct Flaky {
    /// How often its device was opened.
    pub(crate) opened: AtomicUsize,
}

impl Backend for Flaky {
    fn name(&self) -> &'static str {
        "flaky"
    }

    fn devices(&self) -> Vec<DeviceInfo> {
        bp_cpu_scalar::Scalar.devices()
    }

    fn open(&self, device: usize) -> Result<Box<dyn Device>, Error> {
        self.opened.fetch_add(1, Ordering::Relaxed);
        Ok(Box::new(Once { device: bp_cpu_scalar::Scalar.open(device)?, asked: AtomicUsize::new(0) }))
    }
}

struct Once {
    device: Box<dyn Device>,
    asked: AtomicUsize,
}

impl Device for Once {
    fn prepare(&self, plan: &Plan, is_stopped: IsStopped<'_>) -> Result<Box<dyn Solver>, Error> {
        if self.asked.fetch_add(1, Ordering::Relaxed) > 0 {
            return Err(Error::Timeout { device: "flaky".to_owned(), seconds: 60 });
        }
        self.device.prepare(plan, is_stopped)
    }
}

/// Its device, open.
pub(crate) fn open(backend: &'static Flaky) -> Result<Opened, Error> {
    Opened::of(backend, 0)
}
