// Grey values of a coarser grid, for the nodes of one colour: the rounded mean of a node's children, at most four.

// The grey values of the finer grid, in the layout of `greys`.
@group(0) @binding(1) var<storage, read> fine: array<u32>;
@group(0) @binding(2) var<storage, read_write> written: array<u32>;

fn fine_grey(x: u32, y: u32) -> u32 {
    let row = ((x + y) & 1) * parameters.other_height + y;
    let node = x / 2;
    return (fine[row * parameters.other_words + node / 4] >> (8 * (node % 4))) & 0xff;
}

fn mean_of_children(x: u32, y: u32) -> u32 {
    let end = min(vec2(2 * x, 2 * y) + 2, vec2(parameters.other_width, parameters.other_height));
    var sum = 0u;
    var count = 0u;
    for (var child_y = 2 * y; child_y < end.y; child_y++) {
        for (var child_x = 2 * x; child_x < end.x; child_x++) {
            sum += fine_grey(child_x, child_y);
            count++;
        }
    }
    return (sum + count / 2) / count;
}

@compute @workgroup_size(64)
fn coarsen_greys(@builtin(global_invocation_id) id: vec3<u32>) {
    let nodes = nodes(id.x);
    if !nodes.exist {
        return;
    }
    let x = min(columns(nodes), vec4(parameters.width - 1));
    let y = nodes.y;
    let values = vec4(mean_of_children(x[0], y), mean_of_children(x[1], y), mean_of_children(x[2], y), mean_of_children(x[3], y));
    written[grid_index(parameters.colour, y, nodes.word)] = pack(values);
}
