//! Numbers as text.

pub(crate) use bp_charts::number;

/// A sample of numbers: their median and range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spread {
    pub(crate) median: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) count: usize,
}

impl Spread {
    /// The spread of some numbers; `None` of none.
    pub(crate) fn of(numbers: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = numbers.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let (&low, &high) = (sorted.first()?, sorted.last()?);
        let middle = sorted.len() / 2;
        let median = if sorted.len() % 2 == 1 { sorted[middle] } else { (sorted[middle - 1] + sorted[middle]) / 2.0 };
        Some(Self { median, low, high, count: sorted.len() })
    }

    /// The mean of some medians; `None` of none.
    pub(crate) fn mean(spreads: impl IntoIterator<Item = f64>) -> Option<f64> {
        let (sum, count) = spreads.into_iter().fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
        (count > 0).then(|| sum / f64::from(count))
    }
}

impl std::fmt::Display for Spread {
    /// The median, and from three numbers on the range.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = if self.median < 1000.0 { 1 } else { 0 };
        write!(f, "{}", number(self.median, digits))?;
        if self.count >= 3 {
            write!(f, " ({} to {})", number(self.low, digits), number(self.high, digits))?;
        }
        Ok(())
    }
}

/// A whole number with commas between thousands.
pub(crate) fn whole(value: u64) -> String {
    let digits: Vec<char> = value.to_string().chars().collect();
    digits.rchunks(3).rev().map(String::from_iter).collect::<Vec<_>>().join(",")
}

/// Bytes in MiB.
pub(crate) fn mebibytes(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// A value, or the word for there being none.
pub(crate) fn or(value: Option<String>, none: &str) -> String {
    value.unwrap_or_else(|| none.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_have_commas_and_spreads_a_range_from_three_on() {
        assert_eq!(whole(1_000), "1,000");
        assert_eq!(Spread::of([3.0, 1.0, 2.0]).unwrap().to_string(), "2.0 (1.0 to 3.0)");
        assert_eq!(Spread::of([3000.0, 1000.0]).unwrap().to_string(), "2,000");
        assert_eq!(Spread::of([]), None);
        assert_eq!(Spread::mean([1.0, 2.0]), Some(1.5));
    }
}
