// Data costs of the labels of each node's set: the unclipped costs less the least of these, clipped. Other labels cost 255,
// which no sum of a label of the set reaches, so nothing is made from them.

@group(0) @binding(1) var<storage, read_write> cost: array<vec4<u32>>;
// The unclipped costs; see costs.wgsl.
@group(0) @binding(2) var<storage, read> sums: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read> sets: array<u32>;

// The bytes of a sum.
override SUM_BYTES: u32 = 2;

// The costs of a label of a quad at four nodes.
fn unclipped(index: u32, label: u32) -> vec4<u32> {
    let at = 4 * index + label;
    if SUM_BYTES == 2 {
        let pair = sums[at];
        return vec4(pair.x & 0xffff, pair.x >> 16, pair.y & 0xffff, pair.y >> 16);
    }
    return vec4(sums[2 * at], sums[2 * at + 1]);
}

@compute @workgroup_size(GROUP_WORDS, SLICES)
fn restrict_costs(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let nodes = nodes_of(group, local);
    let quads = quads_of(local.y);
    let inside = bytes_where(columns(nodes) < vec4(parameters.width));
    let first = plane_index(nodes.row, nodes.word);
    // A word covers eight columns, so its nodes share a patch.
    let first_word = (window(nodes.y) * patches() + 8 * nodes.word / PATCH_COLUMNS) * set_words();
    var least = vec4(0xffffffffu);
    for (var label = 4 * quads.x; label < min(4 * quads.y, parameters.labels); label++) {
        if ((sets[first_word + label / 32] >> (label % 32)) & 1) == 1 {
            least = min(least, unclipped(first + (label / 4) * parameters.words, label % 4));
        }
    }
    least = least_of_slices(local, least);
    if !nodes.exist {
        return;
    }
    for (var quad = quads.x; quad < quads.y; quad++) {
        let index = first + quad * parameters.words;
        var costs = vec4(0xffffffffu);
        for (var i = 0u; i < 4; i++) {
            let label = 4 * quad + i;
            if label < parameters.labels && ((sets[first_word + label / 32] >> (label % 32)) & 1) == 1 {
                costs[i] = pack(min(unclipped(index, i) - least, vec4(parameters.clip)));
            }
        }
        cost[index] = costs & vec4(inside);
    }
}
