// Labels under the schedule `sweep`, decided one row of a band after another, first those of its even nodes, then those of its odd
// ones. A workgroup has a segment of a band.

@group(0) @binding(1) var<storage, read> even_cost: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> odd_cost: array<vec4<u32>>;
// What odd nodes sent left and right, and both colours up.
@group(0) @binding(3) var<storage, read> sent_left: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> sent_right: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> even_up: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read> odd_up: array<vec4<u32>>;
// [colour][row of the grid][word], two bytes for each of the four nodes.
@group(0) @binding(7) var<storage, read_write> labels: array<vec2<u32>>;
// The labels of the rows above seams that were decided for these: [seam][colour][word].
@group(0) @binding(8) var<storage, read_write> seam_labels: array<vec2<u32>>;
// Grey values; see edge_levels.wgsl.
@group(0) @binding(9) var<storage, read> greys: array<u32>;

const BAND_ROWS: u32 = 32;
const EVEN: u32 = 0;
const ODD: u32 = 1;

// The labels of the odd nodes of the last row, of the even ones of even rows, and of those of odd rows: [word][plane][node].
var<workgroup> decided: array<array<array<u32, 4>, 3>, MOST_WORDS>;

fn plane_of(colour: u32, row: u32) -> u32 {
    return select(1 + (row & 1), 0u, colour == ODD);
}

// The seam above or, if labels are decided for a seam, below a row.
fn seam_index(y: u32, colour: u32, word: u32) -> u32 {
    let seam = y / BAND_ROWS + parameters.seams - 1;
    return (2 * seam + colour) * parameters.words + word;
}

// Labels of the row `before` rows behind the first one that are `shift` nodes aside.
fn labels_of(colour: u32, row: u32, word: u32, shift: i32) -> vec4<u32> {
    var found: vec4<u32>;
    for (var i = 0; i < 4; i++) {
        let node = u32(clamp(4 * i32(word) + i + shift, 0, 4 * i32(MOST_WORDS) - 1));
        found[i] = decided[node / 4][plane_of(colour, row)][node % 4];
    }
    return found;
}

// The labels above, with which neighbours exist.
fn labels_above(nodes: Nodes, before: u32, word: u32) -> Beside {
    var above: Beside;
    above.exist = vec4(nodes.y != 0 && nodes.y != parameters.cut_y && (before > 0 || parameters.seams == 0));
    let other = 1 - nodes.colour;
    if before > 0 {
        above.labels = labels_of(other, before - 1, word, 0);
    } else if above.exist.x {
        let pairs = seam_labels[seam_index(nodes.y, other, nodes.word)];
        above.labels = vec4(pairs.x & 0xffff, pairs.x >> 16, pairs.y & 0xffff, pairs.y >> 16);
    }
    return above;
}

// Data cost plus the messages that count, for a quad of labels.
fn belief(nodes: Nodes, at: u32) -> vec4<u32> {
    let below = at + parameters.quads * parameters.words;
    if nodes.colour == ODD {
        return sum(odd_cost[at], even_up[below]);
    }
    var left = sent_right[at];
    var right = sent_left[at];
    if nodes.parity == 0 {
        left = (left << vec4(8u)) | ((sent_right[at - 1] >> vec4(24u)) & vec4(select(0u, 0xffu, nodes.word > 0)));
    } else {
        let exists = nodes.word + 1 < parameters.words;
        right = (right >> vec4(8u)) | ((sent_left[at + 1] << vec4(24u)) & vec4(select(0u, 0xff000000u, exists)));
    }
    return sum(sum(even_cost[at], odd_up[below]), sum(left, right));
}

// Decides the labels of one colour of a row.
fn decide(local: vec3<u32>, segment: Segment, before: u32, colour: u32) {
    let word = min(local.x, segment.words - 1);
    let nodes = nodes_of_row(segment.row + before, segment.word + word, colour, local.x < segment.words);
    let levels = edge_levels(nodes);
    let slopes = of_edges(levels, parameters.slopes);
    let truncations = of_edges(levels, parameters.truncations);
    var up = labels_above(nodes, before, word);
    up.slopes = unpack(slopes[UP]);
    up.truncations = unpack(truncations[UP]);
    var left: Beside;
    var right: Beside;
    if colour == ODD {
        let x = columns(nodes);
        let to_right = (x + 1 < vec4(parameters.width)) & (x + 1 != vec4(parameters.cut_x));
        let to_left = (x != vec4(0u)) & (x != vec4(parameters.cut_x));
        left = Beside(labels_of(EVEN, before, word, i32(nodes.parity) - 1), to_left, unpack(slopes[LEFT]), unpack(truncations[LEFT]));
        right = Beside(labels_of(EVEN, before, word, i32(nodes.parity)), to_right, unpack(slopes[RIGHT]), unpack(truncations[RIGHT]));
    }
    let first = plane_index(nodes.row, nodes.word);
    var best = vec4(0xffffffffu);
    let quads = quads_of(local.y);
    for (var quad = quads.x; quad < quads.y; quad++) {
        let packed = belief(nodes, first + quad * parameters.words);
        for (var i = 0u; i < 4; i++) {
            let label = 4 * quad + i;
            let total = unpack(packed[i]) + smoothness(label, left) + smoothness(label, right) + smoothness(label, up);
            best = min(best, (total << vec4(LABEL_BITS)) | vec4(label));
        }
    }
    best = least_of_slices(local, best) & vec4((1u << LABEL_BITS) - 1);
    if nodes.exist && local.y == 0 {
        store(segment, nodes, before, word, best);
    }
    workgroupBarrier();
}

fn store(segment: Segment, nodes: Nodes, before: u32, word: u32, best: vec4<u32>) {
    for (var i = 0u; i < 4; i++) {
        decided[word][plane_of(nodes.colour, before)][i] = best[i];
    }
    if !keeps(segment, nodes.word) {
        return;
    }
    let pairs = best.xz | (best.yw << vec2(16u));
    if parameters.seams == 0 {
        labels[grid_index(nodes.colour, nodes.y, nodes.word)] = pairs;
    } else if before + 1 == segment.rows {
        seam_labels[seam_index(nodes.y, nodes.colour, nodes.word)] = pairs;
    }
}

@compute @workgroup_size(GROUP_WORDS, SLICES)
fn decide_rows(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let segment = segment_of(group);
    for (var before = 0u; before < segment.rows; before++) {
        decide(local, segment, before, EVEN);
        decide(local, segment, before, ODD);
    }
}
