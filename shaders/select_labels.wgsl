// Labels of the nodes of one colour: those with the lowest belief or, under the schedule `sweep`, decided in sequence.

// [colour][row of the grid][word], two bytes for each of the four nodes.
@group(0) @binding(6) var<storage, read_write> labels: array<vec2<u32>>;
// Grey values; see edge_levels.wgsl.
@group(0) @binding(7) var<storage, read> greys: array<u32>;

override SWEEP: bool = false;

// Data cost plus the messages that count, for a quad of labels.
fn belief(index: u32, nodes: Nodes) -> vec4<u32> {
    var total = sum(cost[index], from_below(index));
    if !SWEEP || parameters.colour == 0 {
        total = sum(total, sum(from_left(index, nodes), from_right(index, nodes)));
    }
    if !SWEEP {
        total = sum(total, from_above(index));
    }
    return total;
}

// Labels of four nodes of a row and colour, starting at node 4 word + shift, where shift is -1, 0 or 1.
fn decided(colour: u32, y: u32, word: u32, shift: i32) -> vec4<u32> {
    let first = grid_index(colour, y, 0);
    var found: vec4<u32>;
    for (var i = 0; i < 4; i++) {
        let node = clamp(4 * i32(word) + i + shift, 0, 4 * i32(parameters.words) - 1);
        let pair = labels[first + u32(node) / 4][(u32(node) / 2) % 2];
        found[i] = (pair >> (16 * (u32(node) % 2))) & 0xffff;
    }
    return found;
}

struct Decided {
    left: Beside,
    right: Beside,
    up: Beside,
}

fn decided_neighbours(nodes: Nodes) -> Decided {
    let x = columns(nodes);
    let other = 1 - parameters.colour;
    var known: Decided;
    let levels = edge_levels(nodes);
    let slopes = of_edges(levels, parameters.slopes);
    let truncations = of_edges(levels, parameters.truncations);
    known.up.exist = vec4(parameters.labels_above != 0 && nodes.y != 0 && nodes.y != parameters.cut_y);
    known.up.labels = decided(other, max(nodes.y, 1) - 1, nodes.word, 0);
    known.up.slopes = unpack(slopes[UP]);
    known.up.truncations = unpack(truncations[UP]);
    if parameters.colour == 1 {
        known.left.exist = (x != vec4(0u)) & (x != vec4(parameters.cut_x));
        known.right.exist = (x + 1 < vec4(parameters.width)) & (x + 1 != vec4(parameters.cut_x));
        known.left.labels = decided(other, nodes.y, nodes.word, i32(nodes.parity) - 1);
        known.right.labels = decided(other, nodes.y, nodes.word, i32(nodes.parity));
        known.left.slopes = unpack(slopes[LEFT]);
        known.left.truncations = unpack(truncations[LEFT]);
        known.right.slopes = unpack(slopes[RIGHT]);
        known.right.truncations = unpack(truncations[RIGHT]);
    }
    return known;
}

@compute @workgroup_size(GROUP_WORDS, SLICES)
fn select_labels(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let nodes = nodes_of(group, local);
    var known: Decided;
    if SWEEP {
        known = decided_neighbours(nodes);
    }
    let first = plane_index(nodes.row, nodes.word);
    // Each entry holds the total in the high bits and the label in the low bits. So the least entry has the least total
    // and, among equal totals, the smallest label.
    var best = vec4(0xffffffffu);
    let quads = quads_of(local.y);
    for (var quad = quads.x; quad < quads.y; quad++) {
        let packed = belief(first + quad * parameters.words, nodes);
        for (var i = 0u; i < 4; i++) {
            let label = 4 * quad + i;
            var total = unpack(packed[i]);
            if SWEEP {
                total += smoothness(label, known.left) + smoothness(label, known.right) + smoothness(label, known.up);
            }
            best = min(best, (total << vec4(LABEL_BITS)) | vec4(label));
        }
    }
    best = least_of_slices(local, best) & vec4((1u << LABEL_BITS) - 1);
    if !nodes.exist || local.y > 0 {
        return;
    }
    let pairs = best.xz | (best.yw << vec2(16u));
    labels[grid_index(parameters.colour, nodes.y, nodes.word)] = pairs;
}
