//! Lists of pairs: text files with one pair per line.

use std::{
    borrow::Cow,
    fmt::Write as _,
    io,
    path::{Component, Path, PathBuf},
};

use bp_io::{Contents, MOST_TEXT, read_source};

use super::{Found, Pair, name_of};
use crate::{Error, Watch, reading::Room};

/// The format of a line, for messages.
const LINE: &str = "a line holds left, right and, where wanted, a name, with tabs between them if a path has spaces";

/// Most pairs of a list, so that a long file does not fill the memory.
const MOST_PAIRS: usize = 1_000_000;

/// The name of standard input in messages.
pub(super) const INPUT: &str = "standard input";

/// Bytes for each pair while a list is parsed, beside the letters of its paths: the pair, the growing table, why it is refused.
const PARSED: u64 = 512;

/// Bytes for each byte of the longest line while it is split. Most of them are the places of its fields, if they are quoted.
const SPLITTING: u64 = 32;

/// Reads a list from a file or a pipe.
pub(super) fn read(path: &Path, room: Room, watch: &Watch<'_>) -> Result<Found, Error> {
    let (name, path) = (path.display().to_string(), path.to_owned());
    let contents = watch.unless_stopped(move || Contents::within(&path, MOST_TEXT, room.limits.memory))?;
    parse_within(&room.explained_list(contents)?.bytes, &name, room)
}

/// Reads a list from standard input.
pub(super) fn read_input(room: Room, watch: &Watch<'_>) -> Result<Found, Error> {
    let read = move || read_source(io::stdin().lock(), INPUT, MOST_TEXT, room.limits.memory);
    parse_within(&room.explained_list(watch.unless_stopped(read)?)?, INPUT, room)
}

fn parse_within(list: &[u8], name: &str, room: Room) -> Result<Found, Error> {
    room.check_list(name, parsing_bytes(list))?;
    parse(list, name)
}

/// The most memory that a list and its pairs take while it is parsed.
fn parsing_bytes(list: &[u8]) -> u64 {
    let (mut pairs, mut letters, mut longest) = (0, 0, 0);
    for line in list.split(|&byte| byte == b'\n') {
        longest = longest.max(line.len());
        if !line.trim_ascii().is_empty() && !line.starts_with(b"#") {
            pairs += 1;
            // A byte that is no text is shown as four, and a name may be as long as the path of the left image.
            let escapes: usize = line.utf8_chunks().map(|chunk| 3 * chunk.invalid().len()).sum();
            letters += 2 * (line.len() + escapes);
        }
    }
    (list.len() + letters) as u64 + PARSED * pairs.min(MOST_PAIRS) as u64 + SPLITTING * longest as u64
}

/// Parses a list of pairs. Messages call it `source`. Empty lines, lines that start with # and the heading
/// "left,right,name" are skipped. The pair of a line that is not UTF-8 is refused; the other lines count.
///
/// # Errors
/// [`Error::Input`], which names the line.
pub fn parse(bytes: &[u8], source: &str) -> Result<Found, Error> {
    let mut found = Found::default();
    for (index, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let at_line = |what: &str| Error::Input(format!("{source}:{}: {what}", index + 1));
        let text = escaped(line);
        let text = text.trim_start_matches('\u{feff}').trim_end_matches('\r');
        if text.trim().is_empty() || text.starts_with('#') {
            continue;
        }
        let fields = Fields::of(text).map_err(|error| at_line(&error.to_string()))?;
        if index == 0 && fields.is_heading() {
            continue;
        }
        if found.pairs.len() == MOST_PAIRS {
            return Err(at_line(&format!("more than {MOST_PAIRS} pairs; split the list")));
        }
        if std::str::from_utf8(line).is_err() {
            let what = format!("line {} of the list is not a text in UTF-8, as records hold it", index + 1);
            found.refused.insert(found.pairs.len(), what);
        }
        found.pairs.push(fields.pair().map_err(|what| at_line(&what))?);
    }
    Ok(found)
}

/// A text in which bytes that are no UTF-8 are shown as escapes, such as `\xff`.
fn escaped(bytes: &[u8]) -> Cow<'_, str> {
    if let Ok(text) = std::str::from_utf8(bytes) {
        return text.into();
    }
    let mut text = String::new();
    for chunk in bytes.utf8_chunks() {
        text += chunk.valid();
        for byte in chunk.invalid() {
            let _ = write!(text, "\\x{byte:02x}");
        }
    }
    text.into()
}

/// The fields of a line.
struct Fields {
    /// The first three, which is all that a line may have.
    first: Vec<String>,
    count: usize,
}

impl Fields {
    /// Splits a line at tabs, else at commas, else at spaces.
    fn of(line: &str) -> Result<Self, csv::Error> {
        let separator = if line.contains('\t') {
            '\t'
        } else if line.contains(',') {
            ','
        } else {
            ' '
        };
        // Making a reader takes longer than the rest of a line's work.
        if separator == '\t' || !line.contains(['"', '\r']) {
            return Ok(Self::counted(line.split(separator).map(str::trim), separator));
        }
        let mut reader = csv::ReaderBuilder::new();
        let reader = reader.has_headers(false).delimiter(separator as u8).trim(csv::Trim::All);
        let record = reader.from_reader(line.as_bytes()).records().next().transpose()?.unwrap_or_default();
        Ok(Self::counted(record.iter(), separator))
    }

    /// Keeps the first three: a line may be very long.
    fn counted<'a>(fields: impl Iterator<Item = &'a str> + Clone, separator: char) -> Self {
        // Several spaces count as one.
        let fields = fields.filter(|field| separator != ' ' || !field.is_empty());
        Self { first: fields.clone().take(3).map(str::to_owned).collect(), count: fields.count() }
    }

    fn is_heading(&self) -> bool {
        let [left, right, ..] = &self.first[..] else { return false };
        left.eq_ignore_ascii_case("left") && right.eq_ignore_ascii_case("right")
    }

    fn pair(&self) -> Result<Pair, String> {
        let (left, right, name) = match &self.first[..] {
            [left, right] => (left, right, ""),
            [left, right, name] if self.count == 3 => (left, right, name.as_str()),
            _ => return Err(format!("{} fields; {LINE}", self.count)),
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
        assert_eq!(parse(list.as_bytes(), "list").unwrap().pairs, expected);
        assert_eq!(parse(b"/x/../y/l.png r.png", "list").unwrap().pairs[0].name, Path::new("x/y/l"));
    }

    /// A reader for each line took a quarter of a minute for these in a build for tests.
    #[test]
    fn a_long_list_is_read_at_once() {
        let begun = std::time::Instant::now();
        assert_eq!(parse("l.png r.png\n".repeat(100_000).as_bytes(), "list").unwrap().pairs.len(), 100_000);
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
    }

    #[test]
    fn a_line_that_is_not_utf_8_refuses_its_pair_alone() {
        let found = parse(b"a b\n# \xfe\nc\xff d\xc3 \xc3\xa4\xff\ne f\n", "list").unwrap();
        assert_eq!(found.pairs, [pair("a", "b", "a"), pair("c\\xff", "d\\xc3", "\u{e4}\\xff"), pair("e", "f", "e")]);
        assert!(found.refused.len() == 1 && found.refused[&1].contains("line 3"), "{:?}", found.refused);
    }
}
