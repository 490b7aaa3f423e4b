//! The energy of a labelling, in exact integers.

use crate::{DataCost, Error, Model, StereoPair};

/// The energy of a labelling in the units of its profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Energy {
    /// Sum of D(p, f_p) over all pixels.
    pub data: u64,
    /// Sum of V(f_p, f_q) over all pairs of neighbours.
    pub smoothness: u64,
}

impl Energy {
    /// The energy of `labels` `[height][width]`. It uses data costs without a seed and all edges of the image, even those
    /// across a cut, so that the energies of all plans are comparable.
    ///
    /// # Errors
    /// [`Error::PixelCount`] if `labels` does not hold one label per pixel, [`Error::OutOfMemory`].
    pub fn of(pair: &StereoPair, model: &Model, labels: &[u16]) -> Result<Self, Error> {
        let size = pair.size();
        if labels.len() != size.pixels() {
            return Err(Error::PixelCount { size, found: labels.len() });
        }
        let cost = DataCost::of_pair(pair, *model)?;
        let mut energy = Self { data: 0, smoothness: 0 };
        for (i, &label) in labels.iter().enumerate() {
            let (x, y) = (i % size.width, i / size.width);
            energy.data += u64::from(cost.at(x, y, label));
            let right = (x + 1 < size.width).then(|| (i + 1, (x + 1, y)));
            let down = (y + 1 < size.height).then(|| (i + size.width, (x, y + 1)));
            for (other, (other_x, other_y)) in right.into_iter().chain(down) {
                let smoothness = model.smoothness_between(pair.left().grey(x, y), pair.left().grey(other_x, other_y));
                energy.smoothness += u64::from(smoothness.of(label, labels[other]));
            }
        }
        Ok(energy)
    }

    /// The sum of data and smoothness.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.data + self.smoothness
    }
}

/// The label with the lowest data cost of every pixel, `[height][width]`: matching without smoothness. The smallest
/// label wins a tie.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn cheapest_labels(pair: &StereoPair, model: &Model) -> Result<Vec<u16>, Error> {
    let size = pair.size();
    let cost = DataCost::of_pair(pair, *model)?;
    let cheapest = |i| {
        let labels = 0..model.labels() as u16;
        labels.min_by_key(|&label| cost.at(i % size.width, i / size.width, label)).unwrap_or(0)
    };
    Ok((0..size.pixels()).map(cheapest).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Image, Profile};

    #[test]
    fn energy_counts_every_pixel_and_edge_once() {
        let grey = |values: &[u8]| Image::from_grey(2, 2, values).unwrap();
        let pair = StereoPair::new(grey(&[0, 10, 20, 30]), grey(&[0, 20, 20, 30])).unwrap();
        let model = Model::new(Profile::Mrf, 3).unwrap();
        let energy = Energy::of(&pair, &model, &[0, 0, 0, 0]).unwrap();
        assert_eq!(energy, Energy { data: 30, smoothness: 0 });
        let energy = Energy::of(&pair, &model, &[1, 1, 0, 2]).unwrap();
        assert_eq!(energy, Energy { data: 765 + 30 + 765, smoothness: 20 + 20 + 40 });
        // Horizontal neighbours differ by 10 grey values, vertical ones by 20.
        let energy = Energy::of(&pair, &model.with_edges_halved_above(10), &[1, 1, 0, 2]).unwrap();
        assert_eq!(energy.smoothness, 10 + 10 + 40);
        assert!(Energy::of(&pair, &model, &[0; 3]).is_err());
    }

    #[test]
    fn the_cheapest_label_is_the_smallest_on_ties() {
        let grey = |values: &[u8]| Image::from_grey(3, 1, values).unwrap();
        let pair = StereoPair::new(grey(&[7, 7, 9]), grey(&[9, 7, 7])).unwrap();
        assert_eq!(cheapest_labels(&pair, &Model::new(Profile::Mrf, 3).unwrap()).unwrap(), [0, 0, 2]);
    }
}
