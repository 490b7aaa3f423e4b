//! Numbers as text.

/// A number with this many decimals, and commas between thousands.
#[must_use]
pub fn number(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let (whole, fraction) = text.split_once('.').map_or((text.as_str(), None), |(whole, rest)| (whole, Some(rest)));
    let digits: Vec<char> = whole.chars().collect();
    let groups: Vec<String> = digits.rchunks(3).rev().map(|group| group.iter().collect()).collect();
    let sign = if value < 0.0 { "-" } else { "" };
    let fraction = fraction.map_or(String::new(), |fraction| format!(".{fraction}"));
    format!("{sign}{}{fraction}", groups.join(","))
}

/// A number with up to nine decimals, which hides rounding errors.
pub(crate) fn in_full(value: f64) -> String {
    let text = number(value, 9);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0" } else { text }.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_have_commas_and_marks_no_idle_zeros() {
        assert_eq!(number(-1_234_567.891, 2), "-1,234,567.89");
        assert_eq!([number(999.9, 0), number(12.0, 1)], ["1,000", "12.0"]);
        assert_eq!([1e6, 0.3, -0.0, 0.1 + 0.2].map(in_full), ["1,000,000", "0.3", "0", "0.3"]);
    }
}
