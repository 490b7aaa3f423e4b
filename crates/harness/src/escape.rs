//! Escapes strings from records for display: a record, and so every name in it, may come from a stranger.

/// Text for a terminal. Replaces characters that would move the cursor or change the order of letters.
pub(crate) fn printable(text: &str) -> String {
    text.chars().map(|c| if is_shown(c) { c } else { char::REPLACEMENT_CHARACTER }).collect()
}

/// Whether a character is only displayed: it is not a control character or a line separator, and it does not change the
/// writing direction.
#[must_use]
pub fn is_shown(c: char) -> bool {
    let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    !c.is_control() && !turns && !matches!(c, '\u{2028}' | '\u{2029}')
}

/// Text for a line or a table cell of Markdown. It neither ends the cell nor becomes HTML, a link or emphasis.
/// Entities, unlike backslashes, mean the same inside and outside tables.
pub(crate) fn markdown(text: &str) -> String {
    let text: Vec<char> = printable(text).chars().collect();
    let mut escaped = String::with_capacity(text.len());
    for (i, &c) in text.iter().enumerate() {
        let is =
            |place: Option<usize>, what: fn(char) -> bool| place.and_then(|at| text.get(at)).is_some_and(|&c| what(c));
        let within_word = is(i.checked_sub(1), char::is_alphanumeric) && is(Some(i + 1), char::is_alphanumeric);
        // A bare URL becomes a link.
        let of_address = c == ':' && is(Some(i + 1), |next| next == '/');
        let special = matches!(c, '&' | '<' | '|' | '\\' | '`' | '*' | '[' | ']' | '~') || of_address;
        let special = special || (c == '@' && !are_threads(&text[i + 1..]));
        if special || (c == '_' && !within_word) {
            escaped += &format!("&#{};", u32::from(c));
        } else {
            escaped.push(c);
        }
    }
    escaped
}

/// Whether the word after an @ is a number, as in `rayon@2`, and so neither a person nor an address.
fn are_threads(text: &[char]) -> bool {
    let word = || text.iter().take_while(|c| c.is_alphanumeric() || matches!(c, '.' | '-' | '_'));
    word().count() > 0 && word().all(char::is_ascii_digit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_of_a_name_is_markdown_html_or_control() {
        assert_eq!(markdown("GPU | 9 <b>"), "GPU &#124; 9 &#60;b>");
        assert_eq!(markdown("[a](http://b) `c` *d* \\"), "&#91;a&#93;(http&#58;//b) &#96;c&#96; &#42;d&#42; &#92;");
        assert_eq!(markdown("a\r\n# b\u{1b}[2J\u{202e}c"), "a\u{fffd}\u{fffd}# b\u{fffd}&#91;2J\u{fffd}c");
        assert_eq!(markdown("_a_ &lt; m@n m@1.n"), "&#95;a&#95; &#38;lt; m&#64;n m&#64;1.n");
    }

    #[test]
    fn ordinary_names_stay_as_they_are() {
        for name in [
            "rayon@2, ms",
            "llvmpipe (LLVM 15.0.6, 256 bits)",
            "x86_64-unknown-linux-gnu",
            "CTCSBP, Z''''=2",
            "B>1, %: 3.5",
        ] {
            assert_eq!(markdown(name), name);
        }
    }
}
