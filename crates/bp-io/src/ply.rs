//! Point clouds: binary little-endian PLY.

use std::{io::Write, path::Path};

use bp_core::Point;

use crate::{Error, Files};

/// Writes points with positions in millimetres.
///
/// # Errors
/// [`Error::Write`].
pub fn write_points(files: &Files, path: &Path, points: impl Iterator<Item = Point> + Clone) -> Result<(), Error> {
    files.whole(path, |file| write(file, points))
}

fn write(file: &mut dyn Write, points: impl Iterator<Item = Point> + Clone) -> std::io::Result<()> {
    file.write_all(header(points.clone().count()).as_bytes())?;
    for Point { position, colour } in points {
        for value in position {
            file.write_all(&value.to_le_bytes())?;
        }
        file.write_all(&colour)?;
    }
    Ok(())
}

fn header(count: usize) -> String {
    let position = ["x", "y", "z"].map(|name| format!("property float {name}\n")).concat();
    let colour = ["red", "green", "blue"].map(|name| format!("property uchar {name}\n")).concat();
    format!(
        "ply\nformat binary_little_endian 1.0\n\
         comment unit: millimetre\n\
         comment frame: left camera, x right, y down, z forward\n\
         element vertex {count}\n{position}{colour}end_header\n"
    )
}

#[cfg(test)]
mod tests {
    use ply_rs_bw::{
        parser::Parser,
        ply::{DefaultElement, Property},
    };

    use super::*;

    #[test]
    fn another_reader_finds_the_points() {
        let points = [
            Point { position: [-1.5, 2.0, 1000.25], colour: [1, 2, 3] },
            Point { position: [0.0, -1e-3, 5e7], colour: [255, 0, 128] },
        ];
        let mut bytes = Vec::new();
        write(&mut bytes, points.into_iter()).unwrap();
        let ply = Parser::<DefaultElement>::new().read_ply(&mut bytes.as_slice()).unwrap();
        assert!(ply.header.comments.iter().any(|comment| comment.contains("millimetre")));
        let vertices = &ply.payload["vertex"];
        assert_eq!(vertices.len(), 2);
        for (vertex, point) in vertices.iter().zip(points) {
            for (name, value) in ["x", "y", "z"].into_iter().zip(point.position) {
                assert_eq!(vertex[name], Property::Float(value));
            }
            for (name, value) in ["red", "green", "blue"].into_iter().zip(point.colour) {
                assert_eq!(vertex[name], Property::UChar(value));
            }
        }
    }
}
