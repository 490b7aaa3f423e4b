// Message passing: computes the messages that the nodes of one colour send from those that the other colour sent last.
//
// A message is the lower envelope of h(a) + min(s |a - d|, K) over labels a, less its least value. Here h is the data
// cost plus the messages from the three other sides. A pass up the labels and a pass down compute it (Felzenszwalb and
// Huttenlocher 2006). The first pass stores its envelope where the messages go, and the second reads it from there.

// The messages that these nodes send.
@group(0) @binding(6) var<storage, read_write> to_left: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> to_right: array<vec4<u32>>;
@group(0) @binding(8) var<storage, read_write> to_up: array<vec4<u32>>;
@group(0) @binding(9) var<storage, read_write> to_down: array<vec4<u32>>;
// Grey values; see edge_levels.wgsl.
@group(0) @binding(10) var<storage, read> greys: array<u32>;

// Whether messages go only to some sides, as under the schedule `sweep`.
override SELECTIVE: bool = false;

// Four labels of the messages sent left, right, up and down: one vector of sides per label.
struct Quad {
    a: vec4<u32>,
    b: vec4<u32>,
    c: vec4<u32>,
    d: vec4<u32>,
}

// Transposes one vector of labels per side.
fn by_label(left: vec4<u32>, right: vec4<u32>, up: vec4<u32>, down: vec4<u32>) -> Quad {
    return Quad(
        vec4(left.x, right.x, up.x, down.x),
        vec4(left.y, right.y, up.y, down.y),
        vec4(left.z, right.z, up.z, down.z),
        vec4(left.w, right.w, up.w, down.w),
    );
}

fn is_sent(side: u32) -> bool {
    return !SELECTIVE || ((parameters.sends >> side) & 1) != 0;
}

// Reads the envelope of the first pass.
fn load_quad(index: u32) -> Quad {
    var left: vec4<u32>;
    var right: vec4<u32>;
    var up: vec4<u32>;
    var down: vec4<u32>;
    if is_sent(LEFT) {
        left = to_left[index];
    }
    if is_sent(RIGHT) {
        right = to_right[index];
    }
    if is_sent(UP) {
        up = to_up[index];
    }
    if is_sent(DOWN) {
        down = to_down[index];
    }
    return by_label(left, right, up, down);
}

fn store_quad(index: u32, quad: Quad) {
    if is_sent(LEFT) {
        to_left[index] = vec4(quad.a.x, quad.b.x, quad.c.x, quad.d.x);
    }
    if is_sent(RIGHT) {
        to_right[index] = vec4(quad.a.y, quad.b.y, quad.c.y, quad.d.y);
    }
    if is_sent(UP) {
        to_up[index] = vec4(quad.a.z, quad.b.z, quad.c.z, quad.d.z);
    }
    if is_sent(DOWN) {
        to_down[index] = vec4(quad.a.w, quad.b.w, quad.c.w, quad.d.w);
    }
}

// Data cost plus the messages from all sides but the one sent to.
fn gather(index: u32, nodes: Nodes) -> Quad {
    let data = cost[index];
    let left = from_left(index, nodes);
    let right = from_right(index, nodes);
    let above = from_above(index);
    let below = from_below(index);
    let vertical = sum(data, sum(above, below));
    let horizontal = sum(data, sum(left, right));
    return by_label(sum(vertical, right), sum(vertical, left), sum(horizontal, below), sum(horizontal, above));
}

@compute @workgroup_size(64)
fn update_messages(@builtin(global_invocation_id) id: vec3<u32>) {
    let nodes = nodes(id.x);
    if !nodes.exist {
        return;
    }
    let first = plane_index(nodes.row, nodes.word);
    let levels = edge_levels(nodes);
    let step = of_edges(levels, parameters.steps);

    var least = vec4(0xffffffffu);
    // The envelope at the previous label plus one step.
    var offer = vec4(0xffffffffu);
    for (var quad = 0u; quad < parameters.quads; quad++) {
        let index = first + quad * parameters.words;
        var h = gather(index, nodes);
        least = minimum(least, minimum(minimum(h.a, h.b), minimum(h.c, h.d)));
        h.a = minimum(h.a, offer);
        h.b = minimum(h.b, sum(h.a, step));
        h.c = minimum(h.c, sum(h.b, step));
        h.d = minimum(h.d, sum(h.c, step));
        offer = sum(h.d, step);
        store_quad(index, h);
    }

    let truncation = of_edges(levels, parameters.truncations);
    let mask = receivers(nodes);
    offer = vec4(0xffffffffu);
    for (var quad = parameters.quads; quad > 0; quad--) {
        let index = first + (quad - 1) * parameters.words;
        var h = load_quad(index);
        h.d = minimum(h.d, offer);
        h.c = minimum(h.c, sum(h.d, step));
        h.b = minimum(h.b, sum(h.c, step));
        h.a = minimum(h.a, sum(h.b, step));
        offer = sum(h.a, step);
        store_quad(index, Quad(
            minimum(h.a - least, truncation) & mask,
            minimum(h.b - least, truncation) & mask,
            minimum(h.c - least, truncation) & mask,
            minimum(h.d - least, truncation) & mask,
        ));
    }
}
