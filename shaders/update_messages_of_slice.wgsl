// As update_messages, but an invocation computes the messages to one side, for a slice of sixteen labels at four nodes, whose
// values it keeps in registers. A vector of values has a component for each node.
//
// First it computes the lower envelope of its slice alone. Then the slices of a message exchange the two ends of their
// envelopes, and each lets in what others offer. After more than `reach` labels, an offer costs as much as the
// truncation and counts for nothing.

// The messages that these nodes send.
@group(0) @binding(6) var<storage, read_write> to_left: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> to_right: array<vec4<u32>>;
@group(0) @binding(8) var<storage, read_write> to_up: array<vec4<u32>>;
@group(0) @binding(9) var<storage, read_write> to_down: array<vec4<u32>>;
// Grey values; see edge_levels.wgsl.
@group(0) @binding(10) var<storage, read> greys: array<u32>;

// How many sides messages are sent to; `sends` says which.
override SIDES: u32 = 4;
// The invocations of a workgroup: the product of GROUP_WORDS, SLICES and SIDES.
override INVOCATIONS: u32 = 256;

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

// The four vectors of a slice in a plane.
struct Vectors {
    first: vec4<u32>,
    second: vec4<u32>,
    third: vec4<u32>,
    fourth: vec4<u32>,
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

// `at` holds the places of a slice's vectors in a plane. Everything is read without branches between quads, so that all of it is
// on its way at the same time.

fn from_left_of(at: vec4<u32>, nodes: Nodes) -> Vectors {
    let aligned = Vectors(sent_right[at.x], sent_right[at.y], sent_right[at.z], sent_right[at.w]);
    if nodes.parity == 1 {
        return aligned;
    }
    let before = Vectors(sent_right[at.x - 1], sent_right[at.y - 1], sent_right[at.z - 1], sent_right[at.w - 1]);
    let exists = vec4(select(0u, 0xffu, nodes.word > 0));
    let eight = vec4(8u);
    let high = vec4(24u);
    return Vectors(
        (aligned.first << eight) | ((before.first >> high) & exists),
        (aligned.second << eight) | ((before.second >> high) & exists),
        (aligned.third << eight) | ((before.third >> high) & exists),
        (aligned.fourth << eight) | ((before.fourth >> high) & exists),
    );
}

fn from_right_of(at: vec4<u32>, nodes: Nodes) -> Vectors {
    let aligned = Vectors(sent_left[at.x], sent_left[at.y], sent_left[at.z], sent_left[at.w]);
    if nodes.parity == 0 {
        return aligned;
    }
    let behind = Vectors(sent_left[at.x + 1], sent_left[at.y + 1], sent_left[at.z + 1], sent_left[at.w + 1]);
    let exists = vec4(select(0u, 0xff000000u, nodes.word + 1 < parameters.words));
    let eight = vec4(8u);
    let high = vec4(24u);
    return Vectors(
        (aligned.first >> eight) | ((behind.first << high) & exists),
        (aligned.second >> eight) | ((behind.second << high) & exists),
        (aligned.third >> eight) | ((behind.third << high) & exists),
        (aligned.fourth >> eight) | ((behind.fourth << high) & exists),
    );
}

fn from_above_of(at: vec4<u32>) -> Vectors {
    let row = parameters.quads * parameters.words;
    return Vectors(sent_down[at.x - row], sent_down[at.y - row], sent_down[at.z - row], sent_down[at.w - row]);
}

fn from_below_of(at: vec4<u32>) -> Vectors {
    let row = parameters.quads * parameters.words;
    return Vectors(sent_up[at.x + row], sent_up[at.y + row], sent_up[at.z + row], sent_up[at.w + row]);
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
    return Slice(
        add(data.first, x.first, y.first, z.first),
        add(data.second, x.second, y.second, z.second),
        add(data.third, x.third, y.third, z.third),
        add(data.fourth, x.fourth, y.fourth, z.fourth),
    );
}

// The slice with values so great that they offer nothing in quads beyond the last one.
fn within(slice: Slice, quad: u32) -> Slice {
    var now = slice;
    let far = Quad(FAR, FAR, FAR, FAR);
    if quad >= parameters.quads {
        now.first = far;
    }
    if quad + 1 >= parameters.quads {
        now.second = far;
    }
    if quad + 2 >= parameters.quads {
        now.third = far;
    }
    if quad + 3 >= parameters.quads {
        now.fourth = far;
    }
    return now;
}

// The envelope of values, or of an envelope, in the direction of increasing labels, under an offer to the first of them.
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

// Lets in an offer to the first label, which counts for `reach` labels.
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
    for (var apart = 1u; apart < SLICES && SLICE_LABELS * (apart - 1) < parameters.reach; apart++) {
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
@compute @workgroup_size(GROUP_WORDS, SLICES, SIDES)
fn update_messages_of_slice(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let row_groups = (parameters.words + GROUP_WORDS - 1) / GROUP_WORDS;
    let line = group.x / row_groups;
    let word = (group.x - line * row_groups) * GROUP_WORDS + local.x;
    // Invocations without nodes compute some, to meet the others at barriers, and store nothing.
    let nodes = nodes_at(line, min(word, parameters.words - 1));
    let side = side_of(local.z);
    let levels = edge_levels(nodes);
    let step = unpack(of_edges(levels, parameters.steps)[side]);

    let quad = SLICE_QUADS * local.y;
    let quads = min(vec4(quad) + vec4(0u, 1u, 2u, 3u), vec4(parameters.quads - 1));
    let at = vec4(plane_index(nodes.row, nodes.word)) + quads * parameters.words;
    var slice = within(gather(side, at, nodes), quad);
    slice = ascend_slice(slice, FAR, step, SLICE_LABELS);
    slice = descend_slice(slice, FAR, step, SLICE_LABELS);

    let end = (local.z * SLICES + local.y) * GROUP_WORDS + local.x;
    first_ends[end] = pack(min(slice.first.a, vec4(255u)));
    last_ends[end] = pack(min(slice.fourth.d, vec4(255u)));
    let least = least_of_slices(local, least_of(slice));
    let offered = offers(end, local.y, step);
    slice = ascend_slice(slice, offered.to_first, step, parameters.reach);
    slice = descend_slice(slice, offered.to_last, step, parameters.reach);
    if word >= parameters.words {
        return;
    }
    // Some label costs nothing, and messages at most 63. So neither the least nor what exceeds it by the truncation fills a byte.
    let most = least + unpack(of_edges(levels, parameters.truncations)[side]);
    let all = pack(least);
    let receives = receivers(nodes)[side];
    store(side, quad, at, Vectors(
        normalised(slice.first, all, most, receives),
        normalised(slice.second, all, most, receives),
        normalised(slice.third, all, most, receives),
        normalised(slice.fourth, all, most, receives),
    ));
}
