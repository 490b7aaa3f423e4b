//! Charts as pictures of pixels.

use std::sync::{Arc, LazyLock};

use image::{
    ExtendedColorType, ImageEncoder,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};
use resvg::{
    render,
    tiny_skia::{Pixmap, Transform},
    usvg::{Options, Tree, fontdb::Database},
};

use crate::Error;

/// Pixels of the picture for one of the chart.
const SCALE: u32 = 2;

/// The family that stands for sans-serif.
const FAMILY: &str = "Noto Sans";

/// The only fonts that are used, so that the picture does not depend on those of the machine.
static FONTS: LazyLock<Arc<Database>> = LazyLock::new(|| {
    let mut fonts = Database::new();
    [notosans::REGULAR_TTF, notosans::BOLD_TTF].into_iter().for_each(|font| fonts.load_font_data(font.to_vec()));
    fonts.set_sans_serif_family(FAMILY);
    Arc::new(fonts)
});

/// A chart's SVG text as a PNG file of twice its width and height.
///
/// # Errors
///
/// When the text is none that a chart gives.
pub fn png(svg: &str) -> Result<Vec<u8>, Error> {
    let failed = |error: &dyn std::fmt::Display| Error(format!("no picture can be made of the chart: {error}"));
    let options = Options { fontdb: Arc::clone(&FONTS), font_family: FAMILY.to_owned(), ..Options::default() };
    let tree = Tree::from_str(svg, &options).map_err(|error| failed(&error))?;
    let [width, height] = [tree.size().width(), tree.size().height()].map(|side| (SCALE as f32 * side) as u32);
    let mut pixmap = Pixmap::new(width, height).ok_or_else(|| failed(&"it has no size"))?;
    render(&tree, Transform::from_scale(SCALE as f32, SCALE as f32), &mut pixmap.as_mut());
    // The sheet is white and opaque all over.
    let pixels: Vec<u8> = pixmap.data().chunks_exact(4).flat_map(|pixel| &pixel[..3]).copied().collect();
    let mut file = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut file, CompressionType::Best, FilterType::Adaptive);
    encoder.write_image(&pixels, width, height, ExtendedColorType::Rgb8).map_err(|error| failed(&error))?;
    Ok(file)
}
