//! The summary of `bp match` on many pairs.

use std::fmt::Write as _;

use bp_stereo::batch::{PairTimes, Summary};

/// The summary as text.
pub(super) fn text(summary: &Summary) -> String {
    let Summary { pairs, done, skipped, .. } = summary;
    let shard = summary.shard.as_ref().map_or_else(String::new, |shard| format!(" of shard {shard}"));
    let mut text = String::new();
    let failed = summary.failures.len();
    let _ = writeln!(text, "{:<10}{pairs}{shard}: {done} done, {skipped} of them earlier, {failed} failed", "pairs");
    let PairTimes { read_ms, match_ms, write_ms, .. } = summary.times;
    let [read, matching, written, total] = [read_ms, match_ms, write_ms, summary.total_ms].map(|ms| ms / 1000.0);
    let parts = format!("{read:.1} s reading, {matching:.1} s matching, {written:.1} s writing, which may overlap");
    let _ = writeln!(text, "{:<10}{total:.1} s in total; {parts}", "time");
    if let (Some(all), Some(solved), Some(median)) =
        (summary.pairs_per_second, summary.solved_per_second, summary.median_solve_ms)
    {
        let alone = format!("{solved:.2} matching alone (median {median:.1} ms)");
        let _ = writeln!(text, "{:<10}{all:.2} pairs per second from file to file, {alone}", "rate");
    }
    let _ = writeln!(text, "{:<10}{}", "written", summary.output.display());
    text
}
