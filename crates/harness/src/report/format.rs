//! Numbers as text.

pub use bp_charts::number;

pub use crate::statistics::Spread;

/// A whole number with commas between thousands.
pub fn whole(value: u64) -> String {
    let digits: Vec<char> = value.to_string().chars().collect();
    digits.rchunks(3).rev().map(String::from_iter).collect::<Vec<_>>().join(",")
}

/// Bytes in MiB.
pub fn mebibytes(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// The value, or the word for a missing one.
pub fn or(value: Option<String>, none: &str) -> String {
    value.unwrap_or_else(|| none.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_have_commas() {
        assert_eq!(whole(1_000), "1,000");
    }
}
