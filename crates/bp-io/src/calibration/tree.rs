//! Texts as trees of names and values: YAML, XML and JSON, as OpenCV, ROS and Kalibr write them, and KITTI's lines.

use std::path::{Path, PathBuf};

use bp_core::Size;
use roxmltree::{Document, Node};
use serde_json::{Map, Value};

use super::{CalibrationFile, Geometry};
use crate::Error;

/// A part of a file.
#[derive(Clone, Debug)]
pub(super) struct Tree<'a> {
    pub(super) path: &'a Path,
    value: Value,
}

/// A row-major projection matrix [3][4].
type Projection = [[f64; 4]; 3];

impl<'a> Tree<'a> {
    /// Parses a text.
    pub(super) fn parse(path: &'a Path, text: &str) -> Result<Self, Error> {
        let failed = |error: &dyn std::fmt::Display| {
            let what = "not a calibration that is known (Middlebury, OpenCV, ROS, KITTI, Kalibr)";
            // Some parsers show the place in the file, too.
            let error = error.to_string();
            Error::reading(path, &format!("{what}: {:.200}", error.lines().next().unwrap_or_default()))
        };
        let value = if text.trim_start().starts_with('<') {
            from_xml(Document::parse(text).map_err(|error| failed(&error))?.root_element())
        } else {
            // OpenCV begins its files with a directive that is not YAML's.
            let body =
                text.strip_prefix("%YAML").map_or(text, |rest| rest.split_once('\n').map_or("", |(_, body)| body));
            serde_saphyr::from_str(first_document(body)).map_err(|error| failed(&error))?
        };
        if value.is_object() { Ok(Self { path, value }) } else { Err(failed(&"it has no names with values")) }
    }

    pub(super) fn failed(&self, reason: &str) -> Error {
        Error::reading(self.path, &reason)
    }

    /// The part with one of these names, whatever their case.
    pub(super) fn find(&self, names: &[&str]) -> Option<Self> {
        let parts = self.value.as_object()?;
        let found = names.iter().find_map(|name| parts.iter().find(|(key, _)| key.eq_ignore_ascii_case(name)));
        found.map(|(_, value)| Self { path: self.path, value: value.clone() })
    }

    pub(super) fn has(&self, names: &[&str]) -> bool {
        self.find(names).is_some()
    }

    /// The text with one of these names, in lower case.
    pub(super) fn word(&self, names: &[&str]) -> Option<String> {
        Some(self.find(names)?.value.as_str()?.to_lowercase())
    }

    /// The numbers with one of these names: of a list, of a matrix, or of a text.
    pub(super) fn numbers(&self, names: &[&str]) -> Result<Vec<f64>, Error> {
        let found = self.find(names).ok_or_else(|| self.failed(&format!("{} is missing", names[0])))?;
        flat(&found.value).ok_or_else(|| self.failed(&format!("{} should be finite numbers", names[0])))
    }

    /// So many numbers.
    fn exactly<const N: usize>(&self, names: &[&str]) -> Result<[f64; N], Error> {
        let numbers = self.numbers(names)?;
        let wrong = || self.failed(&format!("{} should be {N} numbers, and has {}", names[0], numbers.len()));
        numbers.as_slice().try_into().map_err(|_| wrong())
    }

    /// Three numbers.
    pub(super) fn vector(&self, names: &[&str]) -> Result<[f64; 3], Error> {
        self.exactly(names)
    }

    /// A matrix [3][3].
    pub(super) fn matrix(&self, names: &[&str]) -> Result<[[f64; 3]; 3], Error> {
        let [a, b, c, d, e, f, g, h, i] = self.exactly(names)?;
        Ok([[a, b, c], [d, e, f], [g, h, i]])
    }

    /// A matrix [4][4].
    pub(super) fn square(&self, names: &[&str]) -> Result<[[f64; 4]; 4], Error> {
        let numbers: [f64; 16] = self.exactly(names)?;
        Ok([0, 4, 8, 12].map(|first| [0, 1, 2, 3].map(|i| numbers[first + i])))
    }

    /// A projection matrix.
    pub(super) fn projection(&self, names: &[&str]) -> Result<Projection, Error> {
        let numbers: [f64; 12] = self.exactly(names)?;
        Ok([0, 4, 8].map(|first| [0, 1, 2, 3].map(|i| numbers[first + i])))
    }

    /// A width and a height with one of these names, if there are any.
    pub(super) fn size(&self, names: &[&str]) -> Result<Option<Size>, Error> {
        if !self.has(names) {
            return Ok(None);
        }
        let [width, height] = self.exactly(names)?;
        self.checked_size(width, height).map(Some)
    }

    /// The size of two numbers.
    pub(super) fn checked_size(&self, width: f64, height: f64) -> Result<Size, Error> {
        Size::new(width as usize, height as usize).map_err(|error| self.failed(&error.to_string()))
    }

    /// The geometry of two rectified cameras from their projections, which give lengths in `unit` millimetres.
    pub(super) fn geometry(
        &self,
        [left, right]: [Projection; 2],
        unit: f64,
        size: Option<Size>,
    ) -> Result<Geometry, Error> {
        let [[focal, skew, column, shift], [_, focal_down, row, _], _] = left;
        let near = |one: f64, other: f64| (one - other).abs() <= 1e-3 * focal.abs();
        let same =
            near(focal_down, focal) && near(right[0][0], focal) && near(right[1][1], focal) && near(right[1][2], row);
        if skew != 0.0 || !same {
            return Err(self.failed("its projections are not those of a rectified pair: focal lengths or rows differ"));
        }
        let geometry = Geometry {
            focal,
            baseline: (shift - right[0][3]) / focal * unit,
            doffs: right[0][2] - column,
            principal_point: Some([column, row]),
            file: Some(CalibrationFile { path: PathBuf::from(self.path), size }),
        };
        geometry.possible().map_err(|error| self.failed(&error.to_string()))?;
        Ok(geometry)
    }
}

/// An element as a value: its parts by name, or its text.
fn from_xml(element: Node<'_, '_>) -> Value {
    let parts: Map<String, Value> = element
        .children()
        .filter(Node::is_element)
        .map(|child| (child.tag_name().name().to_owned(), child))
        .map(|(name, child)| (name, from_xml(child)))
        .collect();
    if parts.is_empty() { Value::from(element.text().unwrap_or_default().trim()) } else { Value::Object(parts) }
}

/// All numbers of a list, of the data of a matrix, or of a text. `None` if there is anything else.
fn flat(value: &Value) -> Option<Vec<f64>> {
    let finite = |number: f64| number.is_finite().then_some(number);
    match value {
        Value::Number(number) => Some(vec![finite(number.as_f64()?)?]),
        Value::String(text) => text.split_whitespace().map(|word| word.parse().ok().and_then(finite)).collect(),
        Value::Array(values) => Some(values.iter().map(flat).collect::<Option<Vec<_>>>()?.concat()),
        Value::Object(parts) => flat(parts.get("data")?),
        _ => None,
    }
}

/// `ros2 topic echo` ends every message as YAML ends a document. The first message counts, and the last one may be cut off.
fn first_document(text: &str) -> &str {
    let mut has_begun = false;
    let mut lengths = text.split_inclusive('\n').scan(0, |end, line| {
        *end += line.len();
        Some((*end - line.len(), line))
    });
    let end = lengths.find(|(_, line)| {
        let is_marker = line.starts_with("---") || line.starts_with("...");
        let has_content = !is_marker && !line.trim().is_empty() && !line.starts_with(['#', '%']);
        has_begun |= has_content;
        has_begun && is_marker
    });
    end.map_or(text, |(start, _)| &text[..start])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Tree<'_>, Error> {
        Tree::parse(Path::new("left.yaml"), text)
    }

    #[test]
    fn the_first_of_several_messages_counts() {
        let message = "width: 640\nk: [1, 2]\n";
        // Others follow, the last one cut off, or what the program says between them.
        let others =
            ["", "---\n", "---\nwidth: 320\n---\n", "---\nk: [3,", "---\nA message was lost!!!\n\ttotal: 1\n---\n"];
        for text in others
            .into_iter()
            .flat_map(|after| ["", "---\n", "\n# left\n---\n"].map(|before| format!("{before}{message}{after}")))
        {
            let tree = parse(&text).unwrap();
            assert_eq!(
                (tree.numbers(&["width"]), tree.numbers(&["K"])),
                (Ok(vec![640.0]), Ok(vec![1.0, 2.0])),
                "{text}"
            );
        }
        assert!(parse("%YAML:1.0\n---\nM1: [1]\n").is_ok());
        for text in ["", "---\n", "[1, 2]\n", "{"] {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
