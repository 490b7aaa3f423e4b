//! Charts as raster images.

use std::{
    cmp::Reverse,
    collections::BTreeMap,
    sync::{Arc, LazyLock},
};

use png::{BitDepth, ColorType, Compression, Encoder, EncodingError, Filter};
use resvg::{
    render,
    tiny_skia::{Pixmap, Transform},
    usvg::{Options, Tree, fontdb::Database},
};

use crate::Error;

/// Pixels of the picture per pixel of the chart, in each direction.
const SCALE: u32 = 2;

/// The font family used for sans-serif.
const FAMILY: &str = "Noto Sans";

/// The only fonts used, so that pictures do not depend on the machine's fonts.
static FONTS: LazyLock<Arc<Database>> = LazyLock::new(|| {
    let mut fonts = Database::new();
    [notosans::REGULAR_TTF, notosans::BOLD_TTF].into_iter().for_each(|font| fonts.load_font_data(font.to_vec()));
    fonts.set_sans_serif_family(FAMILY);
    Arc::new(fonts)
});

/// Red, green and blue.
pub type Colour = [u8; 3];

/// An opaque picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pixels {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The colours `[height][width]`.
    pub colours: Vec<Colour>,
}

/// A chart's SVG text as a PNG file of twice its width and height.
///
/// # Errors
///
/// If the text is not an SVG of a chart.
pub fn png(svg: &str) -> Result<Vec<u8>, Error> {
    let mut file = Vec::new();
    encode(&mut file, &pixels(svg, SCALE)?).map_err(|error| failed(&error))?;
    Ok(file)
}

/// Renders an SVG, which must be opaque everywhere, at `scale` times its width and height.
pub(crate) fn pixels(svg: &str, scale: u32) -> Result<Pixels, Error> {
    let options = Options { fontdb: Arc::clone(&FONTS), font_family: FAMILY.to_owned(), ..Options::default() };
    let tree = Tree::from_str(svg, &options).map_err(|error| failed(&error))?;
    let [width, height] = [tree.size().width(), tree.size().height()].map(|side| (scale as f32 * side) as u32);
    let mut pixmap = Pixmap::new(width, height).ok_or_else(|| failed(&"it has no size"))?;
    render(&tree, Transform::from_scale(scale as f32, scale as f32), &mut pixmap.as_mut());
    let colours = pixmap.data().chunks_exact(4).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    Ok(Pixels { width, height, colours })
}

fn failed(error: &dyn std::fmt::Display) -> Error {
    Error(format!("no picture can be made of the chart: {error}"))
}

/// Writes a PNG with 256 colours, which takes a third of the bytes. Charts have few colours besides those at edges.
fn encode(file: &mut Vec<u8>, pixels: &Pixels) -> Result<(), EncodingError> {
    let (palette, indices) = palette(&pixels.colours);
    let mut encoder = Encoder::new(file, pixels.width, pixels.height);
    encoder.set_color(ColorType::Indexed);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_palette(palette.concat());
    encoder.set_compression(Compression::High);
    encoder.set_filter(Filter::NoFilter);
    let mut writer = encoder.write_header()?;
    let run = |run: &[Colour]| std::iter::repeat_n(indices[&run[0]], run.len());
    writer.write_image_data(&runs(&pixels.colours).flat_map(run).collect::<Vec<u8>>())?;
    writer.finish()
}

/// Runs of neighbours of one colour. Most pixels are in long runs, so few colours are looked up.
fn runs(pixels: &[Colour]) -> impl Iterator<Item = &[Colour]> {
    pixels.chunk_by(|a, b| a == b)
}

/// The 256 most frequent of some colours, and for each colour the index of the nearest one among them.
fn palette(pixels: &[Colour]) -> (Vec<Colour>, BTreeMap<Colour, u8>) {
    let mut counts: BTreeMap<Colour, usize> = BTreeMap::new();
    runs(pixels).for_each(|run| *counts.entry(run[0]).or_default() += run.len());
    let mut palette: Vec<Colour> = counts.keys().copied().collect();
    palette.sort_by_key(|colour| Reverse(counts[colour]));
    palette.truncate(256);
    let distance = |a: Colour, b: Colour| -> u32 { (0..3).map(|i| u32::from(a[i].abs_diff(b[i])).pow(2)).sum() };
    let index = |&colour: &Colour| {
        let nearest = (0u8..=255).zip(&palette).min_by_key(|&(_, &other)| distance(colour, other));
        (colour, nearest.map_or(0, |(index, _)| index))
    };
    let indices = counts.keys().map(index).collect();
    (palette, indices)
}
