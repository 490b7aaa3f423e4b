// Label sets of a grid: the labels that differ by at most REACH from those of at least four nodes of the coarser grid around the
// patch, or, if there is no such label, from that of any.

@group(0) @binding(1) var<storage, read_write> sets: array<u32>;
// The labels of the coarser grid, in the layout of select_labels.
@group(0) @binding(2) var<storage, read> labels: array<vec2<u32>>;

const REACH: u32 = 1;
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

// The bits of the labels within reach of one label that fall into a word.
fn bits(label: u32, word: u32) -> u32 {
    let first = 32 * word;
    let lowest = max(max(label, REACH) - REACH, first);
    let highest = min(min(label + REACH, parameters.labels - 1), first + 31);
    var bits = 0u;
    for (var d = lowest; d <= highest; d++) {
        bits |= 1u << (d - first);
    }
    return bits;
}

// The coarse nodes around a patch: first and last column and row.
struct Region {
    first: vec2<u32>,
    last: vec2<u32>,
}

// The labels of a word that are near those of at least one node, and of at least four.
struct Near {
    one: u32,
    four: u32,
}

fn near(region: Region, word: u32) -> Near {
    // Not an array: Mesa's CPU driver does not clear it again when the function is called in a loop.
    var one = 0u;
    var two = 0u;
    var three = 0u;
    var four = 0u;
    for (var y = region.first.y; y <= region.last.y; y++) {
        for (var x = region.first.x; x <= region.last.x; x++) {
            let found = bits(coarse_label(x, y), word);
            four |= three & found;
            three |= two & found;
            two |= one & found;
            one |= found;
        }
    }
    return Near(one, four);
}

// Whether any word has a label near those of four nodes.
fn agree(region: Region) -> bool {
    for (var word = 0u; word < set_words(); word++) {
        if near(region, word).four != 0 {
            return true;
        }
    }
    return false;
}

// An invocation computes one word of the set of a patch.
@compute @workgroup_size(64)
fn label_sets(@builtin(global_invocation_id) id: vec3<u32>) {
    let words = set_words();
    let row = patches() * words;
    let line = id.x / row;
    if line >= parameters.rows {
        return;
    }
    let window = parameters.row + line;
    let patch_index = (id.x - line * row) / words;
    let word = id.x % words;
    let columns = vec2(PATCH_COLUMNS * patch_index, min(PATCH_COLUMNS * (patch_index + 1), parameters.width) - 1);
    let coarse_rows = rows(window) / 2;
    let coarse_columns = columns / 2;
    let first = max(vec2(coarse_columns.x, coarse_rows.x), vec2(MARGIN)) - MARGIN;
    let last = min(vec2(coarse_columns.y, coarse_rows.y) + MARGIN, vec2(parameters.other_width, parameters.other_height) - 1);
    let region = Region(first, last);
    let near = near(region, word);
    var found = near.four;
    if found == 0 && near.one != 0 && !agree(region) {
        found = near.one;
    }
    sets[(window * patches() + patch_index) * words + word] = found;
}
