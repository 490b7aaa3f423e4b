//! What all targets share: a limit of memory for every input.

use std::{alloc::System, panic, process, sync::Once};

use cap::Cap;

/// Bytes that any input may take, and those for each of its own. Readers may hold 65,536 pixels (`harness::fuzzing`).
const FIXED: usize = 32 << 20;
const A_BYTE: usize = 64;

#[global_allocator]
static HELD: Cap<System> = Cap::new(System, usize::MAX);

/// libFuzzer's hook makes every panic a finding, also those of decoders that our readers catch.
static CAUGHT: Once = Once::new();

/// Calls a target. An allocation beyond the limit fails, which ends the process unless the code expects it. So does a panic that nobody
/// catches.
pub fn run(target: harness::fuzzing::Target, bytes: &[u8]) {
    CAUGHT.call_once(|| panic::set_hook(Box::new(|panic| eprintln!("{panic}"))));
    let most = HELD.allocated() + FIXED + A_BYTE * bytes.len();
    HELD.set_limit(most).expect("more is allowed than allocated");
    if panic::catch_unwind(|| target(bytes)).is_err() {
        process::abort();
    }
    HELD.set_limit(usize::MAX).expect("everything is allowed");
}
