//! How often neighbouring lines of a map differ: what the eye sees as seams.

use bp_core::Size;

/// For each row but the first, the share of pixels whose label differs by more than 1 from the pixel above.
#[must_use]
pub fn between_rows(labels: &[u16], Size { width, height }: Size) -> Vec<f64> {
    between(height, width, |y, x| labels[y * width + x])
}

/// For each column but the first, the share of pixels whose label differs by more than 1 from the pixel to the left.
#[must_use]
pub fn between_columns(labels: &[u16], Size { width, height }: Size) -> Vec<f64> {
    between(width, height, |x, y| labels[y * width + x])
}

fn between(lines: usize, len: usize, label: impl Fn(usize, usize) -> u16) -> Vec<f64> {
    let differ = |line: usize| (0..len).filter(|&i| label(line, i).abs_diff(label(line - 1, i)) > 1).count();
    (1..lines).map(|line| differ(line) as f64 / len as f64).collect()
}

/// How many times as frequent jumps are before every `period`-th line as before the others.
#[must_use]
pub fn ratio(jumps: &[f64], period: usize) -> f64 {
    let mean = |at_period: bool| {
        let lines = (1..).zip(jumps).filter(|(line, _)| (line % period == 0) == at_period);
        let (count, sum) = lines.fold((0.0, 0.0), |(count, sum), (_, jumps)| (count + 1.0, sum + jumps));
        sum / count
    };
    mean(true) / mean(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows 0 to 5 of two columns: the first column jumps at row 2, both at row 4.
    #[test]
    fn jumps_are_counted_by_hand() {
        let labels = [0, 0, 1, 1, 9, 2, 9, 2, 0, 0, 0, 1];
        let rows = between_rows(&labels, Size { width: 2, height: 6 });
        assert_eq!(rows, [0.0, 0.5, 0.0, 1.0, 0.0]);
        assert_eq!(between_columns(&labels, Size { width: 2, height: 6 }), [2.0 / 6.0]);
        assert_eq!(ratio(&rows, 4), 1.0 / 0.125);
    }
}
