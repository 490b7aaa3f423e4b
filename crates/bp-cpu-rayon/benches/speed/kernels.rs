//! What the machine can do at most: bytes from and to memory, and operations on bytes.

use std::{
    hint::black_box,
    time::{Duration, Instant},
};

use fearless_simd::{Level, Simd, SimdBase, SimdInt, dispatch};
use rayon::{ThreadPool, prelude::*};

/// How a buffer is passed over.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    /// All bytes are summed up.
    Read,
    /// All are set to one value.
    Write,
    /// 1 is added to each, which counts as a read and a write.
    InPlace,
}

impl Access {
    /// All of them.
    pub(crate) const ALL: [Self; 3] = [Self::Read, Self::Write, Self::InPlace];

    /// Its name in the report.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Read => "read (sum)",
            Self::Write => "write (fill)",
            Self::InPlace => "in place (add 1)",
        }
    }
}

/// Passes over a buffer again and again, each thread of the pool over its own part; returns 10^9 bytes a second.
pub(crate) fn bandwidth(pool: &ThreadPool, access: Access, buffer: &mut [u8], repeats: usize) -> f64 {
    let (level, bytes) = (Level::new(), buffer.len() * repeats);
    let part = buffer.len().div_ceil(pool.current_num_threads());
    let pass = |part: &mut [u8]| {
        for value in 0..repeats {
            match access {
                Access::Read => _ = black_box(dispatch!(level, simd => sum(simd, black_box(&*part)))),
                Access::Write => black_box(&mut *part).fill(value as u8),
                Access::InPlace => dispatch!(level, simd => increment(simd, black_box(&mut *part))),
            }
        }
    };
    let time = timed(pool, || buffer.par_chunks_mut(part).for_each(pass));
    let moved = if access == Access::InPlace { 2 * bytes } else { bytes };
    moved as f64 / time.as_secs_f64() / 1e9
}

/// Vectors that are summed, or computed with, side by side.
const CHAINS: usize = 16;

#[inline(always)]
fn sum<S: Simd>(simd: S, values: &[u8]) -> u8 {
    let mut sums = [S::u8s::splat(simd, 0); CHAINS];
    for block in values.chunks_exact(CHAINS * S::u8s::LEN) {
        for (sum, values) in sums.iter_mut().zip(block.chunks_exact(S::u8s::LEN)) {
            *sum += S::u8s::from_slice(simd, values);
        }
    }
    let total = sums.into_iter().reduce(|a, b| a + b).unwrap_or(S::u8s::splat(simd, 0));
    total.as_slice().iter().fold(0, |sum: u8, &value| sum.wrapping_add(value))
}

#[inline(always)]
fn increment<S: Simd>(simd: S, values: &mut [u8]) {
    let one = S::u8s::splat(simd, 1);
    for values in values.chunks_exact_mut(S::u8s::LEN) {
        (S::u8s::from_slice(simd, values) + one).store_slice(values);
    }
}

/// Adds and takes minima in registers, as message updates do; returns 10^9 operations on a byte a second.
pub(crate) fn arithmetic(pool: &ThreadPool, iterations: usize) -> f64 {
    let level = Level::new();
    let threads = pool.current_num_threads();
    let compute = |_| black_box(dispatch!(level, simd => chains(simd, black_box(iterations), black_box([3, 200]))));
    let mut done = vec![0; threads];
    let time = timed(pool, || (0..threads).into_par_iter().with_max_len(1).map(compute).collect_into_vec(&mut done));
    let operations: usize = done.iter().sum();
    operations as f64 / time.as_secs_f64() / 1e9
}

/// Returns how many operations on a byte it made. No chain waits for another, and what is added and compared differs
/// from chain to chain and is known only when the program runs.
#[inline(always)]
fn chains<S: Simd>(simd: S, iterations: usize, [step, least]: [u8; 2]) -> usize {
    let mut values: [S::u8s; CHAINS] = std::array::from_fn(|i| S::u8s::splat(simd, i as u8));
    let (step, least) = (S::u8s::splat(simd, step), S::u8s::splat(simd, least));
    for _ in 0..iterations {
        for value in &mut values {
            *value = value.saturating_add(step).min(least);
        }
    }
    for value in values {
        black_box(value.as_slice());
    }
    2 * CHAINS * S::u8s::LEN * iterations
}

fn timed(pool: &ThreadPool, work: impl FnOnce() + Send) -> Duration {
    pool.install(|| {
        let start = Instant::now();
        work();
        start.elapsed()
    })
}
