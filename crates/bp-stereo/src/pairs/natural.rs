//! The order that people expect of numbered files.

use std::cmp::Ordering;

/// Compares texts with their runs of digits as numbers: frame2 before frame10. Different texts never compare as equal.
pub(super) fn compare(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    loop {
        match (left.chars().next(), right.chars().next()) {
            (Some(x), Some(y)) if x.is_ascii_digit() && y.is_ascii_digit() => {
                let (number, after) = split_number(left);
                let (other, after_other) = split_number(right);
                let order = number.len().cmp(&other.len()).then(number.cmp(other));
                if order.is_ne() {
                    return order;
                }
                (left, right) = (after, after_other);
            }
            (Some(x), Some(y)) if x == y => (left, right) = (&left[x.len_utf8()..], &right[y.len_utf8()..]),
            (x, y) => return x.cmp(&y).then(a.cmp(b)),
        }
    }
}

/// Splits a text into its leading digits, without leading zeros, and the rest.
fn split_number(text: &str) -> (&str, &str) {
    let (digits, rest) = text.split_at(text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len()));
    (digits.trim_start_matches('0'), rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_count_by_value_and_ties_by_text() {
        let mut names = ["f10", "f2", "f002", "e99", "f2b", "f", "12345678901234567890123", "9", "f10/1", "f2/30"];
        names.sort_by(|a, b| compare(a, b));
        assert_eq!(names, ["9", "12345678901234567890123", "e99", "f", "f002", "f2", "f2/30", "f2b", "f10", "f10/1"]);
    }
}
