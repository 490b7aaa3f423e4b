// First messages of a grid: those from the nodes of one colour to one side, copied from the next coarser grid.
//
// A node starts with the messages that its parent received last (RECEIVER), or with those that its sender's parent sent
// last (SENDER). Buffers keep messages with their senders, so this kernel looks for the coarse sender. Under RECEIVER
// that is the neighbour of the receiver's parent.

@group(0) @binding(1) var<storage, read_write> fine: array<vec4<u32>>;
// The coarser grid's messages to that side, of colour 0 and 1.
@group(0) @binding(2) var<storage, read> even: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> odd: array<vec4<u32>>;

const RECEIVER: u32 = 0;
const SENDER: u32 = 1;
// Under the schedule `sweep`, coarse messages to the left and right are valid only if the sender is odd.
const SWEEP: u32 = 2;
override START: u32 = RECEIVER;

// Row of the coarse sender.
fn coarse_y(y: u32) -> i32 {
    if START == SENDER || parameters.side == LEFT || parameters.side == RIGHT {
        return i32(y / 2);
    }
    return select(i32((y + 1) / 2), i32((y + 1) / 2) - 1, parameters.side == DOWN);
}

// Its column.
fn coarse_x(x: u32, y: i32) -> i32 {
    if START == SENDER || parameters.side == UP || parameters.side == DOWN {
        return i32(x / 2);
    }
    // The sender of a message to the right lies left of the receiver's parent, and vice versa.
    let inward = select(1, -1, parameters.side == RIGHT);
    var sender = i32(x + 1) / 2 + select(0, -1, parameters.side == RIGHT);
    if START == SWEEP && ((sender + y) & 1) == 0 {
        sender += inward;
    }
    return sender;
}

// Four consecutive nodes of a coarse row and colour, for a quad of labels. Nodes beyond the borders are zeros.
fn coarse_nodes(colour: i32, row: u32, first: i32, quad: u32) -> vec4<u32> {
    // The shift also rounds down left of the border.
    let word = first >> 2;
    let aside = u32(first & 3);
    if aside == 0 {
        return coarse_quad(colour, row, word, quad);
    }
    let behind = coarse_quad(colour, row, word + 1, quad) << vec4(32 - 8 * aside);
    return (coarse_quad(colour, row, word, quad) >> vec4(8 * aside)) | behind;
}

// Moves the two low bytes of each word to bytes 0 and 2.
fn apart(bytes: vec4<u32>) -> vec4<u32> {
    return (bytes & vec4(0xffu)) | ((bytes & vec4(0xff00u)) << vec4(8u));
}

fn coarse_quad(colour: i32, row: u32, word: i32, quad: u32) -> vec4<u32> {
    if word < 0 || word >= i32(parameters.other_words) {
        return vec4(0u);
    }
    let index = (row * parameters.quads + quad) * parameters.other_words + u32(word);
    if colour == 0 {
        return even[index];
    }
    return odd[index];
}

// A mask of the nodes that have a neighbour on this side and so a first message.
fn starting(nodes: Nodes) -> u32 {
    let x = columns(nodes);
    var start = x < vec4(parameters.width);
    switch parameters.side {
        case LEFT: {
            start &= x > vec4(0u);
        }
        case RIGHT: {
            start &= x + 1 < vec4(parameters.width);
        }
        case UP: {
            start &= vec4(nodes.y > 0);
        }
        default: {
            start &= vec4(nodes.y + 1 < parameters.height);
        }
    }
    return bytes_where(start);
}

// An invocation computes two words of a fine row.
@compute @workgroup_size(64)
fn refine(@builtin(global_invocation_id) id: vec3<u32>) {
    let row_pairs = (parameters.words + 1) / 2;
    let line = id.x / row_pairs;
    let nodes = nodes_at(line, 2 * (id.x - line * row_pairs));
    if !nodes.exist {
        return;
    }
    let first = plane_index(nodes.row, nodes.word);
    let is_pair = nodes.word + 1 < parameters.words;
    let y = coarse_y(nodes.y);
    let row = u32(y + 1 - i32(parameters.other_first_row));
    // The senders of every second node are consecutive in their row and colour.
    let x = columns(nodes);
    let a = coarse_x(x[0], y);
    let b = coarse_x(x[1], y);
    let mask = vec4(starting(nodes));
    let next_mask = vec4(starting(nodes_at(line, nodes.word + 1)));
    for (var quad = 0u; quad < parameters.quads; quad++) {
        let even_nodes = coarse_nodes((a + y) & 1, row, a >> 1, quad);
        let odd_nodes = coarse_nodes((b + y) & 1, row, b >> 1, quad);
        let index = first + quad * parameters.words;
        fine[index] = (apart(even_nodes) | (apart(odd_nodes) << vec4(8u))) & mask;
        if is_pair {
            let half = vec4(16u);
            fine[index + 1] = (apart(even_nodes >> half) | (apart(odd_nodes >> half) << vec4(8u))) & next_mask;
        }
    }
}
