//! Charts as SVG: [`DotChart`] draws markers in categories, [`Plot`] points and lines between two numeric axes, and
//! [`ColourBar`] the colour scale beside a picture.
//!
//! A chart scales with its page, and has a title and a description for screen readers. Its white background keeps it
//! readable on a dark page. [`png()`] renders a chart to the same pixels on every machine.

mod axis;
mod canvas;
mod colour_bar;
mod data;
mod dots;
mod error;
mod legend;
mod number;
mod picture;
mod plot;
mod sheet;
mod style;

pub use axis::Axis;
pub use colour_bar::ColourBar;
pub use data::{Key, Level, Series, Value};
pub use dots::DotChart;
pub use error::Error;
pub use number::number;
pub use picture::{Colour, Pixels, png};
pub use plot::{Plot, Point};
pub use style::{BLACK, Fill, Line, Marker, Style};

#[cfg(test)]
mod tests {
    use super::*;

    fn dots(logarithmic: bool, values: &[f64]) -> DotChart {
        let point = |&value: &f64| Some(Value { value, low: 0.9 * value, high: 1.1 * value });
        let points: Vec<_> = values.iter().map(point).chain([None]).collect();
        let series = |name: &str, style| Series { name: name.into(), style, points: points.clone() };
        DotChart {
            title: "Speed & <memory>".into(),
            description: "\"All\" > none".into(),
            axis: Axis { logarithmic, ..Axis::linear("seconds < minutes") },
            levels: vec![Level { name: "as fast".into(), value: 1.0, colour: None }],
            keys: vec![],
            categories: ["Baby1", "Aloe", "Cloth1", "Flowerpots", "Bowling2", "Books"].map(String::from).into(),
            groups: vec![
                vec![series("a&b", Style::numbered(0)), series("printed", Style::numbered(0).filled(Fill::Hollow))],
                vec![series("c", Style::numbered(1).filled(Fill::Pale))],
            ],
        }
    }

    fn plot(logarithmic: bool, values: &[f64]) -> Plot {
        let DotChart { title, description, axis, levels, groups, .. } = dots(logarithmic, values);
        let point = |value: Value| Point { x: value, y: value };
        let points: Vec<_> = groups[0][0].points.iter().flatten().copied().map(point).collect();
        let drawn = |line| Series {
            name: format!("{line:?}"),
            style: Style::numbered(1).with_line(line),
            points: points.clone(),
        };
        let series = [Line::Solid, Line::Dashes, Line::Dots, Line::Stairs].map(drawn).into();
        let x = Axis { logarithmic, ..Axis::linear("pixels") };
        Plot { title, description, x, y: axis, levels, keys: vec![], series }
    }

    /// Checks that every tag is closed and every number is finite. Returns the SVG.
    fn well_formed(svg: &str) -> &str {
        let mut open = Vec::new();
        for tag in svg.split('<').skip(1).map(|part| part.split_once('>').unwrap().0) {
            match tag.strip_prefix('/') {
                Some(name) => assert_eq!(open.pop(), Some(name)),
                None => open.extend(tag.split_whitespace().next().filter(|_| !tag.ends_with('/'))),
            }
        }
        assert!(open.is_empty() && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        svg
    }

    fn has_texts(svg: &str, texts: &[&str]) {
        for text in texts {
            assert!(svg.contains(&format!(">\n{text}\n<")), "{text} is missing from {svg}");
        }
    }

    #[test]
    fn every_series_category_and_axis_is_named() {
        let values = [0.5, 2.0, 1500.0];
        let chart = dots(true, &values);
        let names: Vec<_> = chart.categories.iter().map(String::as_str).collect();
        has_texts(&chart.svg().unwrap(), &names);
        has_texts(&chart.svg().unwrap(), &["a&amp;b", "printed", "c", "as fast", "1,000"]);
        let names = ["Solid", "Dashes", "Dots", "Stairs", "as fast", "pixels, logarithmic axis", "100"];
        has_texts(&plot(true, &values).svg().unwrap(), &names);
        let keys = vec![Key { name: "lines".into(), style: Style::line(BLACK, Line::Solid) }];
        let svg = Plot { keys, ..plot(true, &values) }.svg().unwrap();
        has_texts(&svg, &["lines", "as fast"]);
        assert!(!svg.contains("Dashes"), "keys stand in place of the names of the series");
    }

    #[test]
    fn odd_values_are_drawn_or_skipped() {
        let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE];
        let cases: [&[f64]; 7] = [&[], &[3.0; 9], &[0.0; 6], &[0.0, 1e-6, 1e15], &odd, &[-2.0], &[1.0, 1.0 + 1e-15]];
        for (values, logarithmic) in cases.iter().flat_map(|values| [(values, false), (values, true)]) {
            let chart = dots(logarithmic, values);
            let drawn = values.iter().any(|&value| chart.axis.shows(value));
            for svg in [chart.svg().unwrap(), plot(logarithmic, values).svg().unwrap()] {
                assert_eq!(well_formed(&svg).contains("no values"), !drawn, "{values:?}");
            }
        }
        well_formed(&DotChart { categories: vec![], ..dots(true, &[1.0]) }.svg().unwrap());
        well_formed(&DotChart { groups: vec![], title: String::new(), ..dots(false, &[1.0]) }.svg().unwrap());
        well_formed(&Plot { series: vec![], ..plot(false, &[]) }.svg().unwrap());
    }

    #[test]
    fn the_head_is_escaped_and_labelled() {
        let svg = dots(false, &[1.0]).svg().unwrap();
        assert!(svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"900\" height=\"480\" viewBox=\""));
        assert!(svg.contains("aria-labelledby=\"chart-Speed----memory--title chart-Speed----memory--desc\">\n<title"));
        assert!(svg.contains(">Speed &amp; &lt;memory&gt;</title>") && svg.contains("\"All\" &gt; none</desc>"));
    }

    /// Each row of the legend makes the sheet higher and leaves the plot unchanged.
    #[test]
    fn long_legends_do_not_press_the_plot() {
        let height = |count: usize| {
            let name = |i| format!("a long name, which takes a whole row of the legend by itself, {i}");
            let keys = (0..count).map(|i| Key { name: name(i), style: Style::numbered(i) }).collect();
            let svg = Plot { keys, ..plot(true, &[1.0]) }.svg().unwrap();
            let (_, rest) = svg.split_once("height=\"").unwrap();
            rest.split_once('"').unwrap().0.parse::<f64>().unwrap()
        };
        assert!((height(30) - height(10) - 20.0 * canvas::ROW).abs() < 1e-9);
    }

    /// Text is drawn at twice the chart's size, whatever fonts the machine has and whatever names are in a record.
    #[test]
    fn pictures_show_the_words_too() {
        let picture = |title: &str| {
            let file = png(&DotChart { title: title.into(), ..dots(true, &[1.0, 2.0]) }.svg().unwrap()).unwrap();
            let mut decoder = png::Decoder::new(std::io::Cursor::new(file));
            decoder.set_transformations(png::Transformations::EXPAND);
            let mut reader = decoder.read_info().unwrap();
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            let info = reader.next_frame(&mut pixels).unwrap();
            assert_eq!((info.width, info.height, info.color_type), (1800, 960, png::ColorType::Rgb));
            pixels.chunks(3).filter(|pixel| pixel.iter().all(|&value| value < 100)).count()
        };
        assert!(picture("Title") > picture("") + 100);
        assert!(picture("\u{1b}[2J\u{0}\u{ffff}") > 0);
        assert!(png("<svg").is_err());
    }
}
