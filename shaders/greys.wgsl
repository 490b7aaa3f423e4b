// Grey values of the left image, for the nodes of one colour. They determine the levels of the edges of grid 0.

@group(0) @binding(2) var<storage, read_write> written: array<u32>;

@compute @workgroup_size(64)
fn greys(@builtin(global_invocation_id) id: vec3<u32>) {
    let nodes = nodes(id.x);
    if !nodes.exist {
        return;
    }
    let x = min(columns(nodes), vec4(parameters.width - 1));
    let row = nodes.y + APRON;
    let values = vec4(grey(x[0], row), grey(x[1], row), grey(x[2], row), grey(x[3], row));
    written[grid_index(parameters.colour, nodes.y, nodes.word)] = pack(values);
}
