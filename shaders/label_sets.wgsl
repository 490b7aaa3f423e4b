// Label sets of a grid: the labels that differ by at most REACH from those of at least AGREEING nodes of the coarser grid around the
// patch, or, if there is no such label, from that of any.

@group(0) @binding(1) var<storage, read_write> sets: array<u32>;
// The labels of the coarser grid, in the layout of select_labels.
@group(0) @binding(2) var<storage, read> labels: array<vec2<u32>>;

const INVOCATIONS: u32 = 64;
const MOST_LABELS: u32 = 1024;

const REACH: u32 = 1;
// How many nodes suffice.
override AGREEING: u32 = 4;
// How many coarse nodes are looked at beyond the parents.
const MARGIN: u32 = 2;

fn coarse_label(x: u32, y: u32) -> u32 {
    let node = x / 2;
    let row = ((x + y) & 1) * parameters.other_height + y;
    return (labels[row * parameters.other_words + node / 4][(node / 2) % 2] >> (16 * (node % 2))) & 0xffff;
}

// First and last row of a window.
fn rows(window: u32) -> vec2<u32> {
    var rows = vec2(BAND_ROWS * window, BAND_ROWS * window + BAND_ROWS - 1);
    if parameters.seams == 1 {
        let below = BAND_ROWS * (window + 1);
        rows = vec2(below - ROWS_ABOVE, below + ROWS_BELOW - 1);
    }
    return min(rows, vec2(parameters.height - 1));
}

// How many nodes have a label within reach of each one, and whether any of these has enough.
var<workgroup> counts: array<atomic<u32>, MOST_LABELS>;
var<workgroup> some_have_enough: atomic<u32>;

// Counts the labels of the coarse nodes around a patch, whose first and last column and row are given.
fn count(first: vec2<u32>, last: vec2<u32>, invocation: u32) {
    let width = last.x + 1 - first.x;
    for (var node = invocation; node < width * (last.y + 1 - first.y); node += INVOCATIONS) {
        let label = coarse_label(first.x + node % width, first.y + node / width);
        for (var d = max(label, REACH) - REACH; d <= min(label + REACH, parameters.labels - 1); d++) {
            atomicAdd(&counts[d], 1u);
        }
    }
}

// The labels of a word that at least so many nodes have within reach.
fn had_by(fewest: u32, word: u32) -> u32 {
    var found = 0u;
    for (var label = 32 * word; label < min(32 * word + 32, parameters.labels); label++) {
        found |= u32(atomicLoad(&counts[label]) >= fewest) << (label % 32);
    }
    return found;
}

// A workgroup computes the set of a patch.
@compute @workgroup_size(64)
fn label_sets(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) invocation: u32) {
    let line = group.x / patches();
    let window = parameters.row + line;
    let patch_index = group.x - line * patches();
    for (var label = invocation; label < parameters.labels; label += INVOCATIONS) {
        atomicStore(&counts[label], 0u);
    }
    if invocation == 0 {
        atomicStore(&some_have_enough, 0u);
    }
    workgroupBarrier();
    let columns = vec2(PATCH_COLUMNS * patch_index, min(PATCH_COLUMNS * (patch_index + 1), parameters.width) - 1);
    let coarse_rows = rows(window) / 2;
    let coarse_columns = columns / 2;
    let first = max(vec2(coarse_columns.x, coarse_rows.x), vec2(MARGIN)) - MARGIN;
    let last = min(vec2(coarse_columns.y, coarse_rows.y) + MARGIN, vec2(parameters.other_width, parameters.other_height) - 1);
    count(first, last, invocation);
    workgroupBarrier();
    for (var label = invocation; label < parameters.labels; label += INVOCATIONS) {
        if atomicLoad(&counts[label]) >= AGREEING {
            atomicStore(&some_have_enough, 1u);
        }
    }
    workgroupBarrier();
    let fewest = select(1u, AGREEING, atomicLoad(&some_have_enough) == 1);
    for (var word = invocation; word < set_words(); word += INVOCATIONS) {
        sets[(window * patches() + patch_index) * set_words() + word] = had_by(fewest, word);
    }
}
