//! BP's time per pixel, scene by scene.

use super::{BP, Table};
use crate::report::{
    format::{number, or},
    results::{Part, Results, Row},
};

/// A row for each scene, with the printed time and that of each backend.
pub(in crate::report) fn table(results: &Results<'_>) -> Table {
    let backends: Vec<&str> = results.devices().into_iter().map(|(backend, _)| backend).collect();
    let of_backends = backends.iter().map(|backend| format!("{}, us", results.label(backend)));
    let columns: Vec<String> =
        ["scene", "size", "printed, us"].map(str::to_owned).into_iter().chain(of_backends).collect();
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    let note = "Medians, with the range in brackets. The work per pixel is the same on all scenes.";
    let rows: Vec<Row<'_>> = results.rows().collect();
    let rows = rows.chunk_by(|a, b| a.index == b.index).map(|scene| row(results, &backends, scene));
    Table::new("A.5", "BP's time per pixel", &columns).note(note).rows(rows)
}

/// The row of a scene, given its rows on all backends.
fn row(results: &Results<'_>, backends: &[&str], rows: &[Row<'_>]) -> Vec<String> {
    let scene = rows[0].scene;
    let us = |ms: f64| 1000.0 * ms / (scene.width * scene.height) as f64;
    let printed = results.thesis.images.get(rows[0].index).and_then(|image| {
        let ms = results.thesis.time_ms(BP.plan, rows[0].index)?;
        Some(number(1000.0 * ms / f64::from(image.width * image.height), 2))
    });
    let measured = backends.iter().map(|backend| {
        let time = rows.iter().find(|row| row.backend == *backend)?.time(BP.plan, Part::Total)?;
        let [median, low, high] = [time.median, time.low, time.high].map(|ms| number(us(ms), 2));
        Some(format!("{median} ({low} to {high})"))
    });
    let head = [scene.name.clone(), format!("{}x{}", scene.width, scene.height), or(printed, "-")];
    head.into_iter().chain(measured.map(|cell| or(cell, "-"))).collect()
}
