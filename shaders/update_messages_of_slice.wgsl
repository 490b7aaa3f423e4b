// As update_messages, but an invocation computes the messages to one side, for a slice of sixteen labels at four nodes, whose
// values it keeps in registers. A vector has a component for each node.
//
// First it computes the lower envelope of its slice alone. Then the slices of a message exchange the two ends of their
// envelopes, and each lets in what others offer. An offer that has passed `reach` labels costs more than the truncation and
// counts for nothing.

// The messages that these nodes send.
@group(0) @binding(6) var<storage, read_write> to_left: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> to_right: array<vec4<u32>>;
@group(0) @binding(8) var<storage, read_write> to_up: array<vec4<u32>>;
@group(0) @binding(9) var<storage, read_write> to_down: array<vec4<u32>>;
// Grey values; see edge_levels.wgsl.
@group(0) @binding(10) var<storage, read> greys: array<u32>;

override GROUP_WORDS: u32 = 8;
override SLICES: u32 = 1;
// How many sides messages are sent to; `sends` says which.
override SIDES: u32 = 4;
// The product of these.
override INVOCATIONS: u32 = 32;

const SLICE_QUADS: u32 = 4;
const SLICE_LABELS: u32 = 16;

// More than any value, also after as many steps as there are labels.
const FAR = vec4<u32>(0xffffu);
const HALVES = vec4<u32>(0x00ff00ffu);

// The values of four labels.
struct Quad {
    a: vec4<u32>,
    b: vec4<u32>,
    c: vec4<u32>,
    d: vec4<u32>,
}

struct Slice {
    first: Quad,
    second: Quad,
    third: Quad,
    fourth: Quad,
}

// The values of all slices at their first and last labels, one byte per node: [side][slice][word].
var<workgroup> first_ends: array<u32, INVOCATIONS>;
var<workgroup> last_ends: array<u32, INVOCATIONS>;
// The least values of all labels: [word][side][node].
var<workgroup> leasts: array<array<array<atomic<u32>, 4>, 4>, GROUP_WORDS>;

// The side of the messages that an invocation computes: one of those in `sends`.
fn side_of(index: u32) -> u32 {
    if SIDES == 4 {
        return index;
    }
    var rest = parameters.sends;
    for (var i = 0u; i < index; i++) {
        rest &= rest - 1;
    }
    return firstTrailingBit(rest);
}

// The messages from one side.
fn received(from_side: u32, index: u32, nodes: Nodes) -> vec4<u32> {
    switch from_side {
        case LEFT: {
            return from_left(index, nodes);
        }
        case RIGHT: {
            return from_right(index, nodes);
        }
        case UP: {
            return from_above(index);
        }
        default: {
            return from_below(index);
        }
    }
}

// The sums of four bytes, for all labels and nodes.
fn add(a: vec4<u32>, b: vec4<u32>, c: vec4<u32>, d: vec4<u32>) -> Quad {
    if !SATURATING {
        let all = a + b + c + d;
        return Quad(unpack(all.x), unpack(all.y), unpack(all.z), unpack(all.w));
    }
    let even = (a & HALVES) + (b & HALVES) + (c & HALVES) + (d & HALVES);
    let eight = vec4(8u);
    let odd = ((a >> eight) & HALVES) + ((b >> eight) & HALVES) + ((c >> eight) & HALVES) + ((d >> eight) & HALVES);
    return Quad(apart(even.x, odd.x), apart(even.y, odd.y), apart(even.z, odd.z), apart(even.w, odd.w));
}

fn apart(even: u32, odd: u32) -> vec4<u32> {
    return vec4(even & 0xffff, odd & 0xffff, even >> 16, odd >> 16);
}

// Data cost plus the messages from all sides but the one sent to.
fn gather(side: u32, quad: u32, nodes: Nodes) -> Quad {
    if quad >= parameters.quads {
        return Quad(FAR, FAR, FAR, FAR);
    }
    let index = plane_index(nodes.row, nodes.word) + quad * parameters.words;
    // Left and right are 0 and 1, up and down 2 and 3.
    let opposite = received(side ^ 1, index, nodes);
    if side < UP {
        return add(cost[index], opposite, from_above(index), from_below(index));
    }
    return add(cost[index], opposite, from_left(index, nodes), from_right(index, nodes));
}

// The envelope of an envelope or of any values, in the direction of increasing labels, under an offer to the first of them.
fn ascend(quad: Quad, offer: vec4<u32>, step: vec4<u32>) -> Quad {
    let a = min(quad.a, offer);
    let b = min(quad.b, a + step);
    let c = min(quad.c, b + step);
    return Quad(a, b, c, min(quad.d, c + step));
}

fn descend(quad: Quad, offer: vec4<u32>, step: vec4<u32>) -> Quad {
    let d = min(quad.d, offer);
    let c = min(quad.c, d + step);
    let b = min(quad.b, c + step);
    return Quad(min(quad.a, b + step), b, c, d);
}

// Lets an offer in at the first label, as far as it may reach.
fn ascend_slice(slice: Slice, offer: vec4<u32>, step: vec4<u32>, reach: u32) -> Slice {
    var now = slice;
    now.first = ascend(slice.first, offer, step);
    if reach > 4 {
        now.second = ascend(slice.second, now.first.d + step, step);
    }
    if reach > 8 {
        now.third = ascend(slice.third, now.second.d + step, step);
    }
    if reach > 12 {
        now.fourth = ascend(slice.fourth, now.third.d + step, step);
    }
    return now;
}

fn descend_slice(slice: Slice, offer: vec4<u32>, step: vec4<u32>, reach: u32) -> Slice {
    var now = slice;
    now.fourth = descend(slice.fourth, offer, step);
    if reach > 4 {
        now.third = descend(slice.third, now.fourth.a + step, step);
    }
    if reach > 8 {
        now.second = descend(slice.second, now.third.a + step, step);
    }
    if reach > 12 {
        now.first = descend(slice.first, now.second.a + step, step);
    }
    return now;
}

fn least_of_quad(quad: Quad) -> vec4<u32> {
    return min(min(quad.a, quad.b), min(quad.c, quad.d));
}

fn least_of(slice: Slice) -> vec4<u32> {
    return min(min(least_of_quad(slice.first), least_of_quad(slice.second)), min(least_of_quad(slice.third), least_of_quad(slice.fourth)));
}

// What other slices offer to the first and to the last label of this one.
struct Offers {
    to_first: vec4<u32>,
    to_last: vec4<u32>,
}

fn offers(at: u32, slice: u32, step: vec4<u32>) -> Offers {
    var offers = Offers(FAR, FAR);
    for (var apart = 1u; SLICE_LABELS * (apart - 1) < parameters.reach; apart++) {
        let passed = step * (SLICE_LABELS * (apart - 1) + 1);
        if apart <= slice {
            offers.to_first = min(offers.to_first, unpack(last_ends[at - apart * GROUP_WORDS]) + passed);
        }
        if slice + apart < SLICES {
            offers.to_last = min(offers.to_last, unpack(first_ends[at + apart * GROUP_WORDS]) + passed);
        }
    }
    return offers;
}

// Labels as they are stored, less the least values.
fn normalised(quad: Quad, least: u32, most: vec4<u32>, receivers: u32) -> vec4<u32> {
    // No byte is smaller than the least one, so none borrows from the next.
    let words = vec4(pack(min(quad.a, most)), pack(min(quad.b, most)), pack(min(quad.c, most)), pack(min(quad.d, most)));
    return (words - vec4(least)) & vec4(receivers);
}

fn store(side: u32, quad: u32, nodes: Nodes, words: vec4<u32>) {
    if quad >= parameters.quads {
        return;
    }
    let index = plane_index(nodes.row, nodes.word) + quad * parameters.words;
    switch side {
        case LEFT: {
            to_left[index] = words;
        }
        case RIGHT: {
            to_right[index] = words;
        }
        case UP: {
            to_up[index] = words;
        }
        default: {
            to_down[index] = words;
        }
    }
}

// Words of nodes, slices of labels and sides of a workgroup.
@compute @workgroup_size(GROUP_WORDS, SLICES, SIDES)
fn update_messages_of_slice(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let item = group.x * GROUP_WORDS + local.x;
    let line = item / parameters.words;
    // Invocations without nodes compute some, to meet the others at barriers, and store nothing.
    let nodes = nodes_at(min(line, parameters.rows - 1), item - line * parameters.words);
    let side = side_of(local.z);
    let levels = edge_levels(nodes);
    let step = unpack(of_edges(levels, parameters.steps)[side]);

    let quad = SLICE_QUADS * local.y;
    var slice = Slice(gather(side, quad, nodes), gather(side, quad + 1, nodes), gather(side, quad + 2, nodes), gather(side, quad + 3, nodes));
    slice = ascend_slice(slice, FAR, step, SLICE_LABELS);
    slice = descend_slice(slice, FAR, step, SLICE_LABELS);
    let own_least = least_of(slice);

    let row = local.z * SLICES + local.y;
    let at = row * GROUP_WORDS + local.x;
    first_ends[at] = pack(min(slice.first.a, vec4(255u)));
    last_ends[at] = pack(min(slice.fourth.d, vec4(255u)));
    if local.y == 0 {
        for (var i = 0u; i < 4; i++) {
            atomicStore(&leasts[local.x][local.z][i], own_least[i]);
        }
    }
    workgroupBarrier();
    if local.y > 0 {
        for (var i = 0u; i < 4; i++) {
            atomicMin(&leasts[local.x][local.z][i], own_least[i]);
        }
    }
    workgroupBarrier();
    var least: vec4<u32>;
    for (var i = 0u; i < 4; i++) {
        least[i] = atomicLoad(&leasts[local.x][local.z][i]);
    }

    let offered = offers(at, local.y, step);
    slice = ascend_slice(slice, offered.to_first, step, parameters.reach);
    slice = descend_slice(slice, offered.to_last, step, parameters.reach);
    if line >= parameters.rows {
        return;
    }
    // Some label costs nothing, and messages at most 63. So neither the least nor what exceeds it by the truncation fills a byte.
    let most = least + unpack(of_edges(levels, parameters.truncations)[side]);
    let all = pack(least);
    let receives = receivers(nodes)[side];
    store(side, quad, nodes, normalised(slice.first, all, most, receives));
    store(side, quad + 1, nodes, normalised(slice.second, all, most, receives));
    store(side, quad + 2, nodes, normalised(slice.third, all, most, receives));
    store(side, quad + 3, nodes, normalised(slice.fourth, all, most, receives));
}
