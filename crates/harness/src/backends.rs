//! The one list of backends.

use bp_core::Backend;

use crate::failure::Failure;

/// All backends of this build, the default first.
pub(crate) const ALL: [&dyn Backend; 1] = [&bp_cpu_scalar::Scalar];

/// The backend of that name.
pub(crate) fn by_name(name: &str) -> Result<&'static dyn Backend, Failure> {
    ALL.into_iter().find(|backend| backend.name() == name).ok_or_else(|| {
        let names: Vec<_> = ALL.iter().map(|backend| backend.name()).collect();
        Failure::unavailable(format!("--backend {name}: this build has {}", names.join(", ")))
    })
}
