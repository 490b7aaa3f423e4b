//! Lists of pairs: text files with one pair per line.

use std::path::{Component, Path, PathBuf};

use super::{Pair, name_of};
use crate::Error;

/// The format of a line, for messages.
const LINE: &str = "a line holds left, right and, where wanted, a name, with tabs between them if a path has spaces";

/// Most pairs of a list, so that a long file does not fill the memory.
const MOST_PAIRS: usize = 1_000_000;

/// Parses a list of pairs. Messages call it `source`. Empty lines, lines that start with # and the heading
/// "left,right,name" are skipped.
///
/// # Errors
/// [`Error::Input`], which names the line.
pub fn parse(bytes: &[u8], source: &str) -> Result<Vec<Pair>, Error> {
    let mut pairs = Vec::new();
    for (index, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let at_line = |what: &str| Error::Input(format!("{source}:{}: {what}", index + 1));
        let line = std::str::from_utf8(line).map_err(|_| at_line("not a text in UTF-8"))?;
        let line = line.trim_start_matches('\u{feff}').trim_end_matches('\r');
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        let fields = fields(line).map_err(|error| at_line(&error.to_string()))?;
        if !(index == 0 && is_heading(&fields)) {
            if pairs.len() == MOST_PAIRS {
                return Err(at_line(&format!("more than {MOST_PAIRS} pairs; split the list")));
            }
            pairs.push(pair(&fields).map_err(|what| at_line(&what))?);
        }
    }
    Ok(pairs)
}

/// The fields of a line: between tabs, else between commas, else between spaces.
fn fields(line: &str) -> Result<Vec<String>, csv::Error> {
    let separator = if line.contains('\t') {
        '\t'
    } else if line.contains(',') {
        ','
    } else {
        ' '
    };
    // Making a reader takes longer than the rest of a line's work.
    let fields: Vec<String> = if separator == '\t' || !line.contains(['"', '\r']) {
        line.split(separator).map(|field| field.trim().to_owned()).collect()
    } else {
        let mut reader = csv::ReaderBuilder::new();
        let reader = reader.has_headers(false).delimiter(separator as u8).trim(csv::Trim::All);
        let record = reader.from_reader(line.as_bytes()).records().next().transpose()?.unwrap_or_default();
        record.iter().map(str::to_owned).collect()
    };
    // Several spaces count as one.
    Ok(fields.into_iter().filter(|field| separator != ' ' || !field.is_empty()).collect())
}

fn is_heading(fields: &[String]) -> bool {
    fields.len() >= 2 && fields[0].eq_ignore_ascii_case("left") && fields[1].eq_ignore_ascii_case("right")
}

fn pair(fields: &[String]) -> Result<Pair, String> {
    let (left, right, name) = match fields {
        [left, right] => (left, right, ""),
        [left, right, name] => (left, right, name.as_str()),
        other => return Err(format!("{} fields; {LINE}", other.len())),
    };
    if left.is_empty() || right.is_empty() {
        return Err(format!("a path is missing; {LINE}"));
    }
    let name = if name.is_empty() { name_of(Path::new(left)) } else { PathBuf::from(name) };
    let inside = name.components().all(|part| matches!(part, Component::Normal(_)));
    if name.as_os_str().is_empty() || !inside {
        return Err(format!("the name \"{}\" is no relative path below the output folder", name.display()));
    }
    Ok(Pair { name, left: left.into(), right: right.into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(left: &str, right: &str, name: &str) -> Pair {
        Pair { name: name.into(), left: left.into(), right: right.into() }
    }

    #[test]
    fn tabs_commas_and_spaces_separate_and_paths_with_spaces_survive() {
        let list = "\u{feff}left,right,name\n# a comment\n\na b/l.png\tc d/r.png\r\n\
                    /x/../l.png, r.png ,n/m\n\"a b.png\"  'c'   out\n\"a, b.png\",c.png\n  d/e.f.png r.png\na b\tc d\te f\n";
        let expected = [
            pair("a b/l.png", "c d/r.png", "a b/l"),
            pair("/x/../l.png", "r.png", "n/m"),
            pair("a b.png", "'c'", "out"),
            pair("a, b.png", "c.png", "a, b"),
            pair("d/e.f.png", "r.png", "d/e.f"),
            pair("a b", "c d", "e f"),
        ];
        assert_eq!(parse(list.as_bytes(), "list").unwrap(), expected);
        assert_eq!(parse(b"/x/../y/l.png r.png", "list").unwrap()[0].name, Path::new("x/y/l"));
    }

    /// A reader for each line took a quarter of a minute for these in a build for tests.
    #[test]
    fn a_long_list_is_read_at_once() {
        let begun = std::time::Instant::now();
        assert_eq!(parse("l.png r.png\n".repeat(100_000).as_bytes(), "list").unwrap().len(), 100_000);
        assert!(begun.elapsed() < std::time::Duration::from_secs(5));
    }

    #[test]
    fn broken_lines_are_named() {
        for (list, words) in [
            ("a b\nc d e f\n", ["list:2", "4 fields"]),
            ("\n\na\n", ["list:3", "1 fields"]),
            ("a\t\tb\n", ["list:1", "missing"]),
            ("a b ../c\n", ["list:1", "../c"]),
            ("a b /c\n", ["list:1", "/c"]),
            (".. b\n", ["list:1", "name"]),
        ] {
            let message = parse(list.as_bytes(), "list").unwrap_err().to_string();
            assert!(words.iter().all(|word| message.contains(word)), "{message}");
        }
        assert!(parse(b"a b\n\xff c\n", "list").unwrap_err().to_string().contains("list:2"));
    }
}
