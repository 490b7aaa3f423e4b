// As update_messages, but an invocation computes the messages of one node (ONE_NODE, see shared.wgsl): four times as many
// invocations, whose values need no masks of bytes. A vector has a component for each side: left, right, up and down.

@group(0) @binding(1) var<storage, read> cost: array<u32>;
// The messages that all nodes of the other colour sent to their left, right, upper and lower neighbours.
@group(0) @binding(2) var<storage, read> sent_left: array<u32>;
@group(0) @binding(3) var<storage, read> sent_right: array<u32>;
@group(0) @binding(4) var<storage, read> sent_up: array<u32>;
@group(0) @binding(5) var<storage, read> sent_down: array<u32>;
// The messages that these nodes send.
@group(0) @binding(6) var<storage, read_write> to_left: array<u32>;
@group(0) @binding(7) var<storage, read_write> to_right: array<u32>;
@group(0) @binding(8) var<storage, read_write> to_up: array<u32>;
@group(0) @binding(9) var<storage, read_write> to_down: array<u32>;
// Grey values of the whole grid: [colour][row][word], one byte per node.
@group(0) @binding(10) var<storage, read> greys: array<u32>;

// Whether messages go only to some sides, as under the schedule `sweep`.
override SELECTIVE: bool = false;
// Whether the model has more than one level of edges.
override LEVELS: bool = false;

// One node: its row in the grid, its place in its row and colour, and its column.
struct Place {
    y: u32,
    node: u32,
    x: u32,
    // Its first word in a plane, and the distances to those of the next quad and of the next row.
    first: u32,
    quad: u32,
    row: u32,
}

fn is_sent(side: u32) -> bool {
    return !SELECTIVE || ((parameters.sends >> side) & 1) != 0;
}

fn grey(colour: u32, y: u32, node: u32) -> u32 {
    return (greys[grid_index(colour, y, node / 4)] >> (8 * (node % 4))) & 0xff;
}

// The levels of the edges. Those of missing neighbours are arbitrary.
fn edge_levels(at: Place) -> vec4<u32> {
    if !LEVELS {
        return vec4(0u);
    }
    let other = 1 - parameters.colour;
    let own = vec4(grey(parameters.colour, at.y, at.node));
    let right = at.node + (at.x & 1);
    let others = vec4(
        grey(other, at.y, max(right, 1) - 1),
        grey(other, at.y, min(right, at.quad - 1)),
        grey(other, max(at.y, 1) - 1, at.node),
        grey(other, min(at.y + 1, parameters.height - 1), at.node),
    );
    let difference = max(others, own) - min(others, own);
    let most = parameters.most;
    return vec4<u32>(difference > vec4(most[0])) + vec4<u32>(difference > vec4(most[1])) + vec4<u32>(difference > vec4(most[2]));
}

// The value of the level of each edge.
fn of_edges(levels: vec4<u32>, values: array<u32, 4>) -> vec4<u32> {
    if !LEVELS {
        return vec4(values[0]);
    }
    let low = select(vec4(values[0]), vec4(values[1]), levels > vec4(0u));
    return select(select(low, vec4(values[2]), levels > vec4(1u)), vec4(values[3]), levels > vec4(2u));
}

// The messages from each side, for a quad of labels. In its row and colour, a neighbour has the same place as the node, with two
// exceptions: the left neighbour of an even column has the place before, and the right neighbour of an odd column the next one.
fn received(index: u32, at: Place) -> vec4<u32> {
    let right = at.x & 1;
    return vec4(
        select(0u, sent_right[index + right - 1], at.node + right > 0),
        select(0u, sent_left[index + right], at.node + right < at.quad),
        sent_down[index - at.row],
        sent_up[index + at.row],
    );
}

// The envelope of the first pass.
fn load(index: u32) -> vec4<u32> {
    var words: vec4<u32>;
    if is_sent(LEFT) {
        words.x = to_left[index];
    }
    if is_sent(RIGHT) {
        words.y = to_right[index];
    }
    if is_sent(UP) {
        words.z = to_up[index];
    }
    if is_sent(DOWN) {
        words.w = to_down[index];
    }
    return words;
}

fn store(index: u32, words: vec4<u32>) {
    if is_sent(LEFT) {
        to_left[index] = words.x;
    }
    if is_sent(RIGHT) {
        to_right[index] = words.y;
    }
    if is_sent(UP) {
        to_up[index] = words.z;
    }
    if is_sent(DOWN) {
        to_down[index] = words.w;
    }
}

// All bits for the sides where the node has a neighbour to send to.
fn receivers(at: Place) -> vec4<u32> {
    let before = vec4(at.x, at.x + 1, at.y, at.y + 1);
    let exist = (before != vec4(0, parameters.width, 0, parameters.height))
        & (before != vec4(vec2(parameters.cut_x), vec2(parameters.cut_y)));
    return select(vec4(0u), vec4(0xffffffffu), exist);
}

// What fits a byte. Larger values count for nothing.
fn clipped(envelope: vec4<u32>) -> vec4<u32> {
    if !SATURATING {
        return envelope;
    }
    return min(envelope, vec4(255u));
}

@compute @workgroup_size(64)
fn update_messages_of_node(@builtin(global_invocation_id) id: vec3<u32>) {
    let row_nodes = 4 * parameters.words;
    let line = id.x / row_nodes;
    let node = id.x - line * row_nodes;
    let row = parameters.row + line * parameters.row_step;
    let y = parameters.first_row + row;
    let x = 2 * node + ((y + parameters.colour) & 1);
    if line >= parameters.rows || x >= parameters.width {
        return;
    }
    let row_words = parameters.quads * row_nodes;
    let at = Place(y, node, x, (row + 1) * row_words + node, row_nodes, row_words);
    let levels = edge_levels(at);
    let step = of_edges(levels, parameters.steps);

    var least = vec4(0xffffu);
    // The envelope at the previous label plus one step.
    var offer = least;
    for (var quad = 0u; quad < parameters.quads; quad++) {
        let index = at.first + quad * at.quad;
        let data = unpack(cost[index]);
        let messages = received(index, at);
        var words = vec4(0u);
        for (var i = 0u; i < 4; i++) {
            let message = (messages >> vec4(8 * i)) & vec4(0xffu);
            let all = data[i] + message.x + message.y + message.z + message.w;
            let h = vec4(all) - message;
            least = min(least, h);
            let envelope = min(h, offer);
            offer = envelope + step;
            words |= clipped(envelope) << vec4(8 * i);
        }
        store(index, words);
    }

    // Some label costs nothing, and messages at most 63. So neither the least nor what exceeds it by the truncation fills a byte.
    let most = least + of_edges(levels, parameters.truncations);
    let leasts = least * 0x01010101u;
    let mask = receivers(at);
    offer = most;
    for (var quad = parameters.quads; quad > 0; quad--) {
        let index = at.first + (quad - 1) * at.quad;
        let envelopes = load(index);
        var words = vec4(0u);
        for (var i = 0u; i < 4; i++) {
            let shift = vec4(24 - 8 * i);
            let envelope = min(min((envelopes >> shift) & vec4(0xffu), offer), most);
            offer = envelope + step;
            words |= envelope << shift;
        }
        // No byte is smaller than the least value, so none borrows from the next.
        store(index, (words - leasts) & mask);
    }
}
