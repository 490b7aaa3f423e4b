//! Uploads and downloads: pairs, labels and messages in the layout of the device.

use bp_core::{Error, Node, Plan, Schedule, Seed, Side, Size, StereoPair, image::APRON};

use crate::{Program, Queue, layout::colour};

/// The bytes of an image in the upload buffer, including [`APRON`] rows above and below, rounded up to whole vectors.
pub(crate) fn image_bytes(size: Size) -> u64 {
    (3 * size.width as u64 * (size.height + 2 * APRON) as u64).next_multiple_of(16)
}

/// The bytes of the seed after both images: x, y, label, and whether there is a seed.
pub(crate) const SEED_BYTES: u64 = 16;

/// The bytes of all labels: two for each node of both colours of a row, rounded up to whole words.
pub(crate) fn label_bytes(size: Size) -> u64 {
    2 * size.height as u64 * size.width.div_ceil(8) as u64 * 8
}

/// Fills the upload buffer.
pub(crate) fn write_pair(pair: &StereoPair, seed: Option<Seed>, upload: &mut [u8]) {
    let bytes = image_bytes(pair.size()) as usize;
    for (view, place) in [pair.left(), pair.right()].into_iter().zip(upload.chunks_mut(bytes)) {
        for (y, row) in (-(APRON as isize)..).zip(place.chunks_exact_mut(3 * view.size().width)) {
            match view.colours_near(y) {
                Some(colours) => row.copy_from_slice(colours.as_flattened()),
                None => {
                    row.as_chunks_mut().0.iter_mut().zip(view.greys_near(y)).for_each(|(out, &grey)| *out = [grey; 3])
                }
            }
        }
    }
    let seed = seed.map_or([0; 4], |seed| [seed.x as u32, seed.y as u32, seed.label.into(), 1]);
    upload[2 * bytes..][..SEED_BYTES as usize].copy_from_slice(bytemuck::cast_slice(&seed));
}

/// Reads the labels, `[colour][row][node]` in the download buffer, into `[height][width]`.
pub(crate) fn read_labels(size: Size, download: &[u8], labels: &mut [u16]) {
    let row_nodes = size.width.div_ceil(8) * 4;
    for (y, row) in labels.chunks_exact_mut(size.width).enumerate() {
        for colour in 0..2 {
            let stored = &download[2 * (colour * size.height + y) * row_nodes..];
            let nodes = row.iter_mut().skip((y + colour) % 2).step_by(2);
            nodes
                .zip(stored.chunks_exact(2))
                .for_each(|(label, bytes)| *label = u16::from_le_bytes([bytes[0], bytes[1]]));
        }
    }
}

/// Copies the last message that every node received from `side`; see [`bp_core::Solver::read_messages`].
pub(crate) fn read_messages(
    plan: &Plan,
    program: &Program,
    queue: &mut dyn Queue,
    side: Side,
    messages: &mut [u8],
) -> Result<(), Error> {
    messages.fill(0);
    let (size, labels) = (plan.image_size(), plan.model().labels());
    let grid = &program.grids[0];
    for (index, &strip) in grid.strips.iter().enumerate() {
        let buffers = program.last_sent(index, side.opposite());
        let planes = [queue.read(buffers[0])?, queue.read(buffers[1])?];
        for node in size.nodes().filter(|&node| is_held(plan, node, side)) {
            let Some(sender) = plan.neighbour(0, node, side) else { continue };
            if sender.y < strip.first || sender.y >= strip.first + strip.rows {
                continue;
            }
            let received = &mut messages[size.index(node) * labels..][..labels];
            for (label, message) in received.iter_mut().enumerate() {
                *message = planes[colour(sender)][grid.byte(strip, sender, label)];
            }
        }
    }
    if plan.has_label_sets(0) { drop_impossible(plan, program, queue, messages) } else { Ok(()) }
}

/// Sets the values for labels that a node's set lacks to zeros. Their data costs are 255.
fn drop_impossible(plan: &Plan, program: &Program, queue: &mut dyn Queue, messages: &mut [u8]) -> Result<(), Error> {
    let (size, labels, grid) = (plan.image_size(), plan.model().labels(), &program.grids[0]);
    for (&strip, buffers) in grid.strips.iter().zip(&program.costs) {
        let planes = [queue.read(buffers[0])?, queue.read(buffers[1])?];
        for node in size.nodes().filter(|node| (strip.first..strip.first + strip.rows).contains(&node.y)) {
            let received = &mut messages[size.index(node) * labels..][..labels];
            let cost = |label| planes[colour(node)][grid.byte(strip, node, label)];
            received.iter_mut().enumerate().filter(|&(label, _)| cost(label) == u8::MAX).for_each(|(_, m)| *m = 0);
        }
    }
    Ok(())
}

/// Whether the node's edge on `side` holds the message to it. Under [`Schedule::Sweep`] an edge holds only one message.
fn is_held(plan: &Plan, node: Node, side: Side) -> bool {
    plan.settings().schedule != Schedule::Sweep
        || match side {
            Side::Down => true,
            Side::Up => false,
            Side::Left | Side::Right => node.is_even(),
        }
}
