// As update_messages, but an invocation computes the messages to one side, for a slice of labels; see envelope.wgsl.

// The messages that these nodes send.
@group(0) @binding(6) var<storage, read_write> to_left: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> to_right: array<vec4<u32>>;
@group(0) @binding(8) var<storage, read_write> to_up: array<vec4<u32>>;
@group(0) @binding(9) var<storage, read_write> to_down: array<vec4<u32>>;
// See edge_costs.wgsl.
@group(0) @binding(10) var<storage, read> edges: array<vec4<u32>>;

// `at` holds the places of a slice's vectors in a plane.

fn from_above_of(at: vec4<u32>) -> Vectors {
    let row = parameters.quads * parameters.words;
    return Vectors(sent_down[at.x - row], sent_down[at.y - row], sent_down[at.z - row], sent_down[at.w - row]);
}

fn from_below_of(at: vec4<u32>) -> Vectors {
    let row = parameters.quads * parameters.words;
    return Vectors(sent_up[at.x + row], sent_up[at.y + row], sent_up[at.z + row], sent_up[at.w + row]);
}

// Data cost plus the messages from all sides but the one sent to.
fn gather(side: u32, at: vec4<u32>, nodes: Nodes) -> Slice {
    let data = Vectors(cost[at.x], cost[at.y], cost[at.z], cost[at.w]);
    var x: Vectors;
    var y: Vectors;
    var z: Vectors;
    switch side {
        case LEFT: {
            x = from_right_of(at, nodes);
            y = from_above_of(at);
            z = from_below_of(at);
        }
        case RIGHT: {
            x = from_left_of(at, nodes);
            y = from_above_of(at);
            z = from_below_of(at);
        }
        case UP: {
            x = from_left_of(at, nodes);
            y = from_right_of(at, nodes);
            z = from_below_of(at);
        }
        default: {
            x = from_left_of(at, nodes);
            y = from_right_of(at, nodes);
            z = from_above_of(at);
        }
    }
    return add_all(data, x, y, z);
}

fn store_quad(side: u32, at: u32, words: vec4<u32>) {
    switch side {
        case LEFT: {
            to_left[at] = words;
        }
        case RIGHT: {
            to_right[at] = words;
        }
        case UP: {
            to_up[at] = words;
        }
        default: {
            to_down[at] = words;
        }
    }
}

// Stores a slice, apart from quads beyond the last one.
fn store(side: u32, quad: u32, at: vec4<u32>, words: Vectors) {
    if quad < parameters.quads {
        store_quad(side, at.x, words.first);
    }
    if quad + 1 < parameters.quads {
        store_quad(side, at.y, words.second);
    }
    if quad + 2 < parameters.quads {
        store_quad(side, at.z, words.third);
    }
    if quad + 3 < parameters.quads {
        store_quad(side, at.w, words.fourth);
    }
}

// A workgroup computes words of a row, all slices of their labels, and all sides.
@compute @workgroup_size(GROUP_WORDS, SLICES, 4)
fn update_messages_of_slice(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let row_groups = (parameters.words + GROUP_WORDS - 1) / GROUP_WORDS;
    let line = group.x / row_groups;
    let word = (group.x - line * row_groups) * GROUP_WORDS + local.x;
    // Invocations without nodes compute some, to meet the others at barriers, and store nothing.
    let nodes = nodes_at(line, min(word, parameters.words - 1));
    let side = local.z;
    let quad = SLICE_QUADS * local.y;
    let at = places_of(plane_index(nodes.row, nodes.word), quad, parameters.words);
    let words = message(gather(side, at, nodes), local, nodes, side);
    if word < parameters.words {
        store(side, quad, at, words);
    }
}
