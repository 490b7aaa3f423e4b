//! Matches one pair many times, on one matcher, and prints the seconds from grey values in memory to a map. `scripts/measure-python`
//! holds the time that Python takes for the same pair against them.
//!
//! `cargo run --release -p bp-stereo --example seconds -- IMAGES WIDTH HEIGHT LABELS MATCHES`, where IMAGES has the grey values of the
//! left image and then those of the right one, a byte each.

use std::{env, error::Error, fs, time::Instant};

use bp_stereo::{Image, Matcher, Options};

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<_> = env::args().skip(1).collect();
    let [images, numbers @ ..] = words.as_slice() else { return Err("name a file of images".into()) };
    let numbers = numbers.iter().map(|word| word.parse()).collect::<Result<Vec<usize>, _>>()?;
    let [width, height, labels, matches] = numbers[..] else { return Err("give four numbers after the file".into()) };
    let bytes = fs::read(images)?;
    let (left, right) = bytes.split_at(width * height);
    let mut matcher = Matcher::new(&Options::default().with_labels(labels))?;
    for _ in 0..matches {
        let begin = Instant::now();
        matcher.compute(&Image::from_grey(width, height, left)?, &Image::from_grey(width, height, right)?)?;
        println!("{}", begin.elapsed().as_secs_f64());
    }
    Ok(())
}
