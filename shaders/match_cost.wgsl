// Data costs of the image, for the nodes of one colour.

// A known match: the point where the cuts cross, its label, and whether it exists.
struct Seed {
    x: u32,
    y: u32,
    label: u32,
    exists: u32,
}

// The features of every pixel of both images.
@group(0) @binding(3) var<storage, read> left: array<u32>;
@group(0) @binding(4) var<storage, read> right: array<u32>;
@group(0) @binding(5) var<storage, read> seed: Seed;

// Constants of the profile.
override LARGEST_COST: u32 = 0;
override OUT_OF_RANGE_COST: u32 = 0;

// The columns of both images to the left of the nodes.
override MARGIN: u32 = 0;

// The width of both images.
fn pair_width() -> u32 {
    return MARGIN + parameters.width;
}

fn difference(a: vec4<u32>, b: vec4<u32>) -> vec4<u32> {
    return max(a, b) - min(a, b);
}

// One of three bytes.
fn channel(values: vec4<u32>, index: u32) -> vec4<u32> {
    return (values >> vec4(8 * index)) & vec4(0xffu);
}

fn sum_of_differences(a: vec4<u32>, b: vec4<u32>) -> vec4<u32> {
    let green = difference(channel(a, 1), channel(b, 1));
    return difference(channel(a, 0), channel(b, 0)) + green + difference(channel(a, 2), channel(b, 2));
}

fn gradient_difference(a: vec4<u32>, b: vec4<u32>) -> vec4<u32> {
    let grey = min(difference(channel(a, 0), channel(b, 0)), vec4(20u));
    let gradient = min(difference(channel(a, 1), channel(b, 1)), vec4(4u));
    return (3 * grey + 35 * gradient + 5) / 10;
}

// By how much the grey value of a lies outside the range around b.
fn outside(a: vec4<u32>, b: vec4<u32>) -> vec4<u32> {
    let value = channel(a, 0);
    let least = channel(b, 1);
    let greatest = channel(b, 2);
    return max(max(value, greatest) - greatest, max(least, value) - value);
}

// The cost of matching two pixels, for four pairs.
fn compare(a: vec4<u32>, b: vec4<u32>) -> vec4<u32> {
    switch PROFILE {
        case THESIS: {
            return (7 * min(difference(a, b), vec4(15u)) + 5) / 10;
        }
        case CENSUS, CENSUS_16, CENSUS_32: {
            return min(countOneBits(a ^ b), vec4(LARGEST_COST));
        }
        case GRADIENT: {
            return gradient_difference(a, b);
        }
        case BIRCHFIELD_TOMASI: {
            return (15 * min(min(outside(a, b), outside(b, a)), vec4(20u)) + 5) / 10;
        }
        default: {
            return sum_of_differences(a, b);
        }
    }
}

// Whether these nodes touch the seed's point.
fn touches_seed(nodes: Nodes) -> vec4<bool> {
    let x = columns(nodes);
    let row = seed.exists != 0 && (nodes.y == seed.y || nodes.y + 1 == seed.y);
    return vec4(row) & ((x == vec4(seed.x)) | (x + 1 == vec4(seed.x)));
}

// The costs of one label at four nodes; 0 beyond the border.
fn costs(nodes: Nodes, at_left: vec4<u32>, seeded: vec4<bool>, label: u32) -> vec4<u32> {
    let x = columns(nodes);
    let match_x = vec4<i32>(MARGIN + x) - (parameters.min_disparity + i32(label));
    let inside = (match_x >= vec4(0)) & (match_x < vec4(i32(pair_width())));
    let safe = select(vec4(0u), vec4<u32>(match_x), inside) + nodes.y * pair_width();
    let at_right = vec4(right[safe.x], right[safe.y], right[safe.z], right[safe.w]);
    var cost = select(vec4(OUT_OF_RANGE_COST), compare(at_left, at_right), inside);
    let seed_cost = select(LARGEST_COST, 0u, max(label, seed.label) - min(label, seed.label) <= 1);
    cost = select(cost, vec4(seed_cost), seeded);
    return select(vec4(0u), cost, x < vec4(parameters.width));
}

@compute @workgroup_size(GROUP_WORDS, SLICES)
fn match_cost(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let nodes = nodes_of(group, local);
    let quads = quads_of(local.y);
    let x = MARGIN + min(columns(nodes), vec4(parameters.width - 1)) + nodes.y * pair_width();
    let at_left = vec4(left[x.x], left[x.y], left[x.z], left[x.w]);
    let seeded = touches_seed(nodes);
    var least = vec4(0xffffffffu);
    for (var label = 4 * quads.x; label < min(4 * quads.y, parameters.labels); label++) {
        least = min(least, costs(nodes, at_left, seeded, label));
    }
    least = least_of_slices(local, least);
    if !nodes.exist {
        return;
    }
    for (var quad = quads.x; quad < quads.y; quad++) {
        var unclipped: array<vec4<u32>, 4>;
        for (var i = 0u; i < 4; i++) {
            unclipped[i] = costs(nodes, at_left, seeded, 4 * quad + i);
        }
        store(nodes, quad, unclipped, least);
    }
}
