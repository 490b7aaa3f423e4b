// The message of a slice of eight or sixteen labels at four nodes, whose values an invocation keeps in registers. A vector of values has a
// component for each node.
//
// First it computes the lower envelope of its slice alone. Then the slices of a message exchange the two ends of their
// envelopes, and each lets in what others offer. After more than `reach` labels, an offer costs as much as the
// truncation and counts for nothing.

// The invocations of a workgroup: the product of its three sizes.
override INVOCATIONS: u32 = 256;

// Whether edges have several levels; then `edges` of the kernel has their costs, as edge_costs leaves them.
override LEVELS: bool = false;

// The quads of a slice: two or four.
override SLICE_QUADS: u32 = 4;

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

// What the left neighbours of four nodes sent, from the aligned vectors and the last node of those before them, where `exists` is set.
fn one_later(aligned: Vectors, before: Vectors, exists: u32) -> Vectors {
    let mask = vec4(exists & 0xff);
    let eight = vec4(8u);
    let high = vec4(24u);
    return Vectors(
        (aligned.first << eight) | ((before.first >> high) & mask),
        (aligned.second << eight) | ((before.second >> high) & mask),
        (aligned.third << eight) | ((before.third >> high) & mask),
        (aligned.fourth << eight) | ((before.fourth >> high) & mask),
    );
}

// The same of the right neighbours, from the first node of those behind.
fn one_earlier(aligned: Vectors, behind: Vectors, exists: u32) -> Vectors {
    let mask = vec4(exists & 0xff000000);
    let eight = vec4(8u);
    let high = vec4(24u);
    return Vectors(
        (aligned.first >> eight) | ((behind.first << high) & mask),
        (aligned.second >> eight) | ((behind.second << high) & mask),
        (aligned.third >> eight) | ((behind.third << high) & mask),
        (aligned.fourth >> eight) | ((behind.fourth << high) & mask),
    );
}

// What the kernel's `sent_right` and `sent_left` brought the nodes of a word from both sides, at the places of a slice's vectors. Everything
// is read without branches between quads, so that all of it is on its way at the same time.

fn from_left_of(at: vec4<u32>, nodes: Nodes) -> Vectors {
    let aligned = Vectors(sent_right[at.x], sent_right[at.y], sent_right[at.z], sent_right[at.w]);
    if nodes.parity == 1 {
        return aligned;
    }
    let before = Vectors(sent_right[at.x - 1], sent_right[at.y - 1], sent_right[at.z - 1], sent_right[at.w - 1]);
    return one_later(aligned, before, select(0u, 0xffffffffu, nodes.word > 0));
}

fn from_right_of(at: vec4<u32>, nodes: Nodes) -> Vectors {
    let aligned = Vectors(sent_left[at.x], sent_left[at.y], sent_left[at.z], sent_left[at.w]);
    if nodes.parity == 0 {
        return aligned;
    }
    let behind = Vectors(sent_left[at.x + 1], sent_left[at.y + 1], sent_left[at.z + 1], sent_left[at.w + 1]);
    return one_earlier(aligned, behind, select(0u, 0xffffffffu, nodes.word + 1 < parameters.words));
}

// The places of the quads of a slice, from that of the quad 0 on. Quads beyond the last one read the last one.
fn places_of(first: u32, quad: u32, stride: u32) -> vec4<u32> {
    return vec4(first) + min(vec4(quad) + vec4(0u, 1u, 2u, 3u), vec4(parameters.quads - 1)) * stride;
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

// The sums of data costs and three messages.
fn add_all(data: Vectors, x: Vectors, y: Vectors, z: Vectors) -> Slice {
    let far = Quad(FAR, FAR, FAR, FAR);
    var all = Slice(add(data.first, x.first, y.first, z.first), add(data.second, x.second, y.second, z.second), far, far);
    if SLICE_QUADS == 4 {
        all.third = add(data.third, x.third, y.third, z.third);
        all.fourth = add(data.fourth, x.fourth, y.fourth, z.fourth);
    }
    return all;
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
    if SLICE_QUADS == 4 && quad + 2 >= parameters.quads {
        now.third = far;
    }
    if SLICE_QUADS == 4 && quad + 3 >= parameters.quads {
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
    if SLICE_QUADS == 4 && reach > 8 {
        now.third = ascend(slice.third, now.second.d + step, step);
    }
    if SLICE_QUADS == 4 && reach > 12 {
        now.fourth = ascend(slice.fourth, now.third.d + step, step);
    }
    return now;
}

fn descend_slice(slice: Slice, offer: vec4<u32>, step: vec4<u32>, reach: u32) -> Slice {
    var now = slice;
    if SLICE_QUADS == 2 {
        now.second = descend(slice.second, offer, step);
        if reach > 4 {
            now.first = descend(slice.first, now.second.a + step, step);
        }
        return now;
    }
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
    let labels = 4 * SLICE_QUADS;
    for (var apart = 1u; apart < SLICES && labels * (apart - 1) < parameters.reach; apart++) {
        let passed = step * (labels * (apart - 1) + 1);
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

// Steps or truncations of the edges to this side.
fn edge_costs(nodes: Nodes, side: u32, which: u32, usual: u32) -> vec4<u32> {
    if !LEVELS {
        return vec4(usual);
    }
    return unpack(edges[2 * grid_index(nodes.colour, nodes.y, nodes.word) + which][side]);
}

// The messages to this side with these values, zeros where no node receives one. All invocations of a workgroup must call it.
fn message(values: Slice, local: vec3<u32>, nodes: Nodes, side: u32) -> Vectors {
    let step = edge_costs(nodes, side, 0, parameters.steps[0]);
    let truncation = edge_costs(nodes, side, 1, parameters.truncations[0]);
    let receives = receivers_at(nodes, side);
    var slice = within(values, SLICE_QUADS * local.y);
    slice = ascend_slice(slice, FAR, step, 4 * SLICE_QUADS);
    slice = descend_slice(slice, FAR, step, 4 * SLICE_QUADS);

    let end = (local.z * SLICES + local.y) * GROUP_WORDS + local.x;
    first_ends[end] = pack(min(slice.first.a, vec4(255u)));
    let last = select(slice.fourth.d, slice.second.d, SLICE_QUADS == 2);
    last_ends[end] = pack(min(last, vec4(255u)));
    let least = least_of_slices(local, least_of(slice));
    let offered = offers(end, local.y, step);
    slice = ascend_slice(slice, offered.to_first, step, parameters.reach);
    slice = descend_slice(slice, offered.to_last, step, parameters.reach);
    // Some label costs nothing, and messages at most 63. So neither the least nor what exceeds it by the truncation fills a byte.
    let most = least + truncation;
    let all = pack(least);
    return Vectors(
        normalised(slice.first, all, most, receives),
        normalised(slice.second, all, most, receives),
        normalised(slice.third, all, most, receives),
        normalised(slice.fourth, all, most, receives),
    );
}
