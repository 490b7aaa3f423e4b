//! Decided labels by plane, as the neighbours that are decided next read them.

use bp_core::{Error, memory};

use crate::block::LANES;

/// Labels of the nodes of a block.
pub(crate) type Labels = [u16; LANES];

/// The labels of two rows, `[row mod 2][plane][lane]`, with the lanes of one block more before and after each plane.
#[derive(Default)]
pub(crate) struct Decided {
    labels: Vec<u16>,
    /// The lanes of a plane with those around it.
    lanes: usize,
}

/// The labels of rows of so many patches.
fn len(patches: usize) -> usize {
    4 * LANES * (patches + 2)
}

/// The bytes of rows of so many patches.
pub(crate) fn bytes(patches: usize) -> u64 {
    (len(patches) * size_of::<u16>()) as u64
}

impl Decided {
    /// Makes room for rows of so many patches.
    pub(crate) fn fit(&mut self, patches: usize) -> Result<(), Error> {
        memory::grow("labels", &mut self.labels, len(patches), 0)?;
        self.lanes = LANES * (patches + 2);
        Ok(())
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        memory::bytes(&self.labels)
    }

    /// Takes in a whole row.
    pub(crate) fn read(&mut self, y: usize, row: &[u16]) {
        for plane in 0..2 {
            let start = self.start(y, plane);
            let labels = self.labels[start..].iter_mut().zip(row.iter().skip(plane).step_by(2));
            labels.for_each(|(label, &decided)| *label = decided);
        }
    }

    /// The labels of a patch, moved by `by` lanes: -1, 0 or 1. There are no meaningful ones outside the image.
    #[inline(always)]
    pub(crate) fn of(&self, y: usize, plane: usize, patch: usize, by: isize) -> &Labels {
        let start = (self.start(y, plane) + LANES * patch).wrapping_add_signed(by);
        self.labels[start..].first_chunk().unwrap_or(&[0; LANES])
    }

    /// Writes the labels of a patch.
    #[inline(always)]
    pub(crate) fn write(&mut self, y: usize, plane: usize, patch: usize, labels: &Labels) {
        let start = self.start(y, plane) + LANES * patch;
        self.labels[start..start + LANES].copy_from_slice(labels);
    }

    /// Copies a row to its columns.
    #[inline(always)]
    pub(crate) fn copy_to(&self, y: usize, row: &mut [u16]) {
        for (patch, columns) in row.chunks_mut(2 * LANES).enumerate() {
            let [even, odd] = [0, 1].map(|plane| self.of(y, plane, patch, 0));
            let mut labels = [0; 2 * LANES];
            for (pair, (even, odd)) in labels.chunks_exact_mut(2).zip(even.iter().zip(odd)) {
                (pair[0], pair[1]) = (*even, *odd);
            }
            match columns.first_chunk_mut() {
                Some(columns) => *columns = labels,
                None => columns.copy_from_slice(&labels[..columns.len()]),
            }
        }
    }

    /// Where lane 0 of a plane is.
    fn start(&self, y: usize, plane: usize) -> usize {
        (2 * (y % 2) + plane) * self.lanes + LANES
    }
}
