// Stores the data costs of four nodes, for match_cost and coarsen: normalised by each node's least cost, then clipped. Also
// stores the unclipped costs if the next coarser grid needs them for its sums.

@group(0) @binding(1) var<storage, read_write> cost: array<vec4<u32>>;
// [row][quad][word][label of the quad], with 2 or 4 bytes for each of the four nodes.
@group(0) @binding(2) var<storage, read_write> sums: array<vec2<u32>>;

// The bytes of a stored sum; 0 if none is stored.
override SUM_BYTES: u32 = 0;

// The stored costs of one label.
fn stored(nodes: Nodes, label: u32, unclipped: vec4<u32>, least: vec4<u32>) -> u32 {
    let clipped = min(unclipped - least, vec4(parameters.clip));
    let costs = select(clipped, vec4(parameters.padding_cost), label >= parameters.labels);
    return pack(select(vec4(0u), costs, columns(nodes) < vec4(parameters.width)));
}

fn store(nodes: Nodes, quad: u32, unclipped: array<vec4<u32>, 4>, least: vec4<u32>) {
    let index = plane_index(nodes.row, nodes.word) + quad * parameters.words;
    cost[index] = vec4(
        stored(nodes, 4 * quad, unclipped[0], least),
        stored(nodes, 4 * quad + 1, unclipped[1], least),
        stored(nodes, 4 * quad + 2, unclipped[2], least),
        stored(nodes, 4 * quad + 3, unclipped[3], least),
    );
    for (var i = 0u; i < 4; i++) {
        let s = unclipped[i];
        if SUM_BYTES == 2 {
            sums[4 * index + i] = vec2(s.x | (s.y << 16), s.z | (s.w << 16));
        } else if SUM_BYTES == 4 {
            sums[2 * (4 * index + i)] = s.xy;
            sums[2 * (4 * index + i) + 1] = s.zw;
        }
    }
}
