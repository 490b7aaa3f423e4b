//! Figures 3.2 to 3.6 of the thesis, and A.1: the disparity maps of each algorithm.

use std::{fmt::Write as _, path::Path};

use base64::{Engine, engine::general_purpose::STANDARD};
use bp_core::{DisparityMap, Size};
use maud::html;

use super::{
    Drawing,
    results::Results,
    tables::{BP, CFBP, CFCSBP, CTBP, CTCSBP, Named, ours::CENSUS},
};
use bp_io::{Colours, Limits, encode_picture, read_map};

use crate::{escape::printable, failure::Failure};

/// Space around and between maps, and for text and the colour bar, in pixels of the drawing.
const GAP: usize = 14;
const NAME_HEIGHT: usize = 24;
const TITLE_HEIGHT: usize = 48;
const BAR_HEIGHT: usize = 64;
/// Maps per row.
const ACROSS: usize = 3;

/// One figure per algorithm: those of the thesis, and ours.
pub(super) fn all(folder: &Path, results: &Results<'_>) -> Result<Vec<Drawing>, Failure> {
    let figures = [("3.2", BP), ("3.3", CFBP), ("3.4", CFCSBP), ("3.5", CTBP), ("3.6", CTCSBP[0]), ("A.1", CENSUS)];
    figures.into_iter().map(|(number, plan)| figure(folder, results, number, &plan)).collect()
}

fn figure(folder: &Path, results: &Results<'_>, number: &str, plan: &Named) -> Result<Drawing, Failure> {
    let maps = results.scenes().map(|(index, scene)| {
        // All backends give the same labels, so one map per scene is enough.
        let measured = results.rows().filter(|row| row.index == index).find_map(|row| row.measured(plan.plan));
        let map = measured.map(|measured| read_map(&folder.join(&measured.map), None, Limits::default()));
        Ok((scene.name.as_str(), map.transpose()?.map(halved)))
    });
    let maps = maps.collect::<Result<Vec<_>, Failure>>()?;
    let labels = results.record.run.labels;
    let last = labels.saturating_sub(1);
    let title = format!("Figure {number}: disparity maps of {}", plan.title);
    Ok(Drawing {
        name: format!("figure-{number}"),
        caption: format!(
            "Colours show disparities from 0 to {last} px. Every second pixel is drawn. Data: {}.",
            results.setting()
        ),
        svg: draw(&title, &results.setting(), &maps, last as f32)
            .map_err(|error| Failure::other(format!("figure {number}: {error}")))?,
        title,
        table: None,
    })
}

/// Every second pixel of every second row, to keep the page small.
fn halved(map: DisparityMap) -> DisparityMap {
    let size = map.size();
    let half = size.coarser();
    let at = |i: usize| map.values()[2 * (i / half.width) * size.width + 2 * (i % half.width)];
    DisparityMap::new(half, (0..half.pixels()).map(at).collect()).unwrap_or(map)
}

fn draw(
    title: &str,
    setting: &str,
    maps: &[(&str, Option<DisparityMap>)],
    last: f32,
) -> Result<String, image::ImageError> {
    let sizes = || maps.iter().filter_map(|(_, map)| map.as_ref()).map(DisparityMap::size);
    let cell = Size {
        width: sizes().map(|size| size.width).max().unwrap_or(100),
        height: sizes().map(|size| size.height).max().unwrap_or(100),
    };
    let down = maps.len().div_ceil(ACROSS);
    let (width, row_height) = (ACROSS * (cell.width + GAP) + GAP, cell.height + GAP + NAME_HEIGHT);
    let height = TITLE_HEIGHT + down * row_height + GAP + BAR_HEIGHT;
    let escaped = |text: &str| html! { (printable(text)) }.into_string();
    let (title, setting) = (escaped(title), escaped(setting));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         role=\"img\" font-family=\"sans-serif\" font-size=\"15\"><title>{title}</title>\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/><text x=\"{GAP}\" y=\"24\" font-weight=\"bold\">{title}</text>\
         <text x=\"{GAP}\" y=\"44\">{setting}</text>"
    );
    for (i, (name, map)) in maps.iter().enumerate() {
        let (x, y) = (GAP + i % ACROSS * (cell.width + GAP), TITLE_HEIGHT + GAP + i / ACROSS * row_height);
        let _ = write!(svg, "<text x=\"{x}\" y=\"{}\">{}</text>", y + NAME_HEIGHT - 8, escaped(name));
        let y = y + NAME_HEIGHT;
        match map {
            Some(map) => svg += &embedded(map, x, y, last)?,
            None => _ = write!(svg, "<text x=\"{x}\" y=\"{}\">no map</text>", y + NAME_HEIGHT),
        }
    }
    svg += &colour_bar(&title, width - 2 * GAP, height - BAR_HEIGHT, last);
    Ok(svg + "</svg>\n")
}

/// A map as a PNG inside the drawing.
fn embedded(map: &DisparityMap, x: usize, y: usize, last: f32) -> Result<String, image::ImageError> {
    let mut png = Vec::new();
    encode_picture(&mut png, map, 0.0..=last)?;
    let Size { width, height } = map.size();
    let data = STANDARD.encode(png);
    Ok(format!(
        "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" href=\"data:image/png;base64,{data}\"/>"
    ))
}

/// A colour bar with its range. The id of its gradient derives from `title`, to be unique on the page.
fn colour_bar(title: &str, width: usize, top: usize, last: f32) -> String {
    let id: String = title.chars().filter(char::is_ascii_alphanumeric).collect();
    const STOPS: usize = 16;
    let stop = |i: usize| {
        let [r, g, b] = Colours::Viridis.at(i as f64 / STOPS as f64);
        format!("<stop offset=\"{}%\" stop-color=\"rgb({r},{g},{b})\"/>", 100.0 * i as f32 / STOPS as f32)
    };
    let stops: String = (0..=STOPS).map(stop).collect();
    let tick = |i: usize| {
        let anchor = ["start", "middle", "middle", "middle", "end"][i];
        let (x, value) = (GAP + width * i / 4, last * i as f32 / 4.0);
        format!("<text x=\"{x}\" y=\"{}\" text-anchor=\"{anchor}\">{value:.0} px</text>", top + 38)
    };
    let ticks: String = (0..5).map(tick).collect();
    format!(
        "<defs><linearGradient id=\"{id}\">{stops}</linearGradient></defs>\
         <rect x=\"{GAP}\" y=\"{top}\" width=\"{width}\" height=\"18\" fill=\"url(#{id})\"/>{ticks}"
    )
}
