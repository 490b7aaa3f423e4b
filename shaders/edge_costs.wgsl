// The cost of every edge of every node of one colour, for kernels in which many invocations need it: two vectors for a word, steps and
// truncations, with a component for each side and a byte for each node.

@group(0) @binding(1) var<storage, read_write> edges: array<vec4<u32>>;
// Grey values; see edge_levels.wgsl.
@group(0) @binding(2) var<storage, read> greys: array<u32>;

@compute @workgroup_size(64)
fn edge_costs(@builtin(global_invocation_id) id: vec3<u32>) {
    let nodes = nodes(id.x);
    if !nodes.exist {
        return;
    }
    let levels = edge_levels(nodes);
    let at = 2 * grid_index(nodes.colour, nodes.y, nodes.word);
    edges[at] = of_edges(levels, parameters.steps);
    edges[at + 1] = of_edges(levels, parameters.truncations);
}
