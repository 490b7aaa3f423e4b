// First messages of a grid: those from the nodes of one colour to one side, made from the next coarser grid's.
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
// Messages are interpolated between the four coarse nodes nearest to the receiver.
const SWEEP: u32 = 2;
// Zeros, on the coarsest grid.
const ZERO: u32 = 3;
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

// As coarse_nodes, for columns x, x + 2, x + 4 and x + 6 of coarse row y.
fn coarse_messages(x: i32, y: i32, quad: u32) -> vec4<u32> {
    return coarse_nodes((x + y) & 1, u32(y + 1 - i32(parameters.other_first_row)), x >> 1, quad);
}

// Under SWEEP: the row of the coarse sender for the other coarse row that the receiver lies between; the same row if there
// is no such row, or it receives nothing from that side.
fn far_y(y: u32, near: i32) -> i32 {
    let up = i32(parameters.side == UP);
    let far = near + select(-1, 1, ((i32(y) - up) & 1) == 1);
    return select(near, far, far - up >= 0 && far < i32(parameters.other_height));
}

// The mean of two bytes, rounded up, for all 16.
fn mean(a: vec4<u32>, b: vec4<u32>) -> vec4<u32> {
    return (a | b) - (((a ^ b) >> vec4(1u)) & ~HIGH);
}

// Three quarters of `near` and one of `far`.
fn nearer(near: vec4<u32>, far: vec4<u32>) -> vec4<u32> {
    return mean(mean(near, far), near);
}

// Interpolates between the coarse rows y.x, the nearer one, and y.y, from columns x.x and x.y on.
fn between_rows(x: vec2<i32>, y: vec2<i32>, quad: u32) -> vec4<u32> {
    return nearer(coarse_messages(x.x, y.x, quad), coarse_messages(x.y, y.y, quad));
}

// Whole bytes where columns x, x + 2, x + 4 and x + 6 exist on the coarser grid.
fn coarse_columns(x: i32) -> vec4<u32> {
    let columns = vec4(x) + vec4(0, 2, 4, 6);
    return vec4(bytes_where((columns >= vec4(0)) & (columns < vec4(i32(parameters.other_width)))));
}

// The first messages of every second node of two words, and of those between them.
struct Alternate {
    even: vec4<u32>,
    odd: vec4<u32>,
}

// Interpolates also between columns: a receiver in an even column lies nearer to its parent's left neighbour, one in an odd
// column to the right one.
fn between_columns(parents: Alternate, parity: u32, even: i32, odd: i32, y: vec2<i32>, quad: u32) -> Alternate {
    var beside = Alternate(parents.odd, parents.even);
    if parity == 0 {
        beside.even = between_rows(vec2(even - 1), y, quad);
    } else {
        beside.odd = between_rows(vec2(odd + 1), y, quad);
    }
    let aside = select(-1, 1, parity == 1);
    let at_even = coarse_columns(even + aside);
    let at_odd = coarse_columns(odd + aside);
    beside.even = (beside.even & at_even) | (parents.even & ~at_even);
    beside.odd = (beside.odd & at_odd) | (parents.odd & ~at_odd);
    return Alternate(nearer(parents.even, beside.even), nearer(parents.odd, beside.odd));
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

// An invocation computes two words of a fine row, for a slice of the labels.
@compute @workgroup_size(GROUP_WORDS, SLICES)
fn refine(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let item = group.x * GROUP_WORDS + local.x;
    let row_pairs = (parameters.words + 1) / 2;
    let line = item / row_pairs;
    let nodes = nodes_at(line, 2 * (item - line * row_pairs));
    if !nodes.exist {
        return;
    }
    let first = plane_index(nodes.row, nodes.word);
    let is_pair = nodes.word + 1 < parameters.words;
    let near = coarse_y(nodes.y);
    let y = vec2(near, far_y(nodes.y, near));
    // The senders of every second node are consecutive in their row and colour.
    let x = columns(nodes);
    let even = vec2(coarse_x(x[0], y.x), coarse_x(x[0], y.y));
    let odd = vec2(coarse_x(x[1], y.x), coarse_x(x[1], y.y));
    // If the sender would lie below the last coarse row, there is no message, and no other row replaces it.
    let exists = select(0u, 0xffffffffu, START != SWEEP || near < i32(parameters.other_height));
    let mask = vec4(starting(nodes) & exists);
    let next_mask = vec4(starting(nodes_at(line, nodes.word + 1)) & exists);
    let quads = quads_of(local.y);
    for (var quad = quads.x; quad < quads.y; quad++) {
        var messages: Alternate;
        if START == SWEEP {
            messages = Alternate(between_rows(even, y, quad), between_rows(odd, y, quad));
            if parameters.side == UP {
                messages = between_columns(messages, nodes.parity, even.x, odd.x, y, quad);
            }
        } else if START != ZERO {
            messages = Alternate(coarse_messages(even.x, y.x, quad), coarse_messages(odd.x, y.x, quad));
        }
        let index = first + quad * parameters.words;
        fine[index] = (apart(messages.even) | (apart(messages.odd) << vec4(8u))) & mask;
        if is_pair {
            let half = vec4(16u);
            fine[index + 1] = (apart(messages.even >> half) | (apart(messages.odd >> half) << vec4(8u))) & next_mask;
        }
    }
}
