//! The rows of a map that one thread works on at a time.

use std::ops::RangeInclusive;

/// What lies around them is computed by two threads, which few rows make expensive. Many take much memory.
pub(super) const TOGETHER: RangeInclusive<usize> = 16..=96;

/// The rows of all parts of a map but the last, such that each thread gets equally many parts of about the same height.
pub(super) fn rows_together(height: usize, threads: usize) -> usize {
    let parts = height.div_ceil(threads * TOGETHER.end()) * threads;
    height.div_ceil(parts).max(*TOGETHER.start())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_thread_gets_equally_many_parts() {
        for (height, threads, rows) in
            [(555, 1, 93), (555, 2, 93), (555, 4, 70), (555, 8, 70), (96, 1, 96), (97, 1, 49)]
        {
            assert_eq!(rows_together(height, threads), rows, "{height} rows, {threads} threads");
            assert_eq!(height.div_ceil(rows) % threads, 0);
        }
        // Short maps have fewer parts.
        assert_eq!([rows_together(1, 1), rows_together(1, 64), rows_together(30, 2)], [16; 3]);
    }
}
