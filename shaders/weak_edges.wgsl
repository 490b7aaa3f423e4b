// Finds weak edges, for update_messages and select_labels: edges between nodes whose grey values differ by more than a
// threshold. The kernel's `greys` holds the grey values of the whole grid: [colour][row][word], one byte per node.

// Whether the model has weak edges.
override WEAK: bool = false;

// The grey values of the left, right, upper and lower neighbours, indexed like their messages. Missing neighbours have
// arbitrary values.
fn neighbour_greys(nodes: Nodes) -> vec4<u32> {
    let other = 1 - parameters.colour;
    let aligned = greys[grid_index(other, nodes.y, nodes.word)];
    var left = aligned;
    var right = aligned;
    if nodes.parity == 0 {
        left = (aligned << 8) | (greys[grid_index(other, nodes.y, max(nodes.word, 1) - 1)] >> 24);
    } else {
        right = (aligned >> 8) | (greys[grid_index(other, nodes.y, min(nodes.word + 1, parameters.words - 1))] << 24);
    }
    let above = greys[grid_index(other, max(nodes.y, 1) - 1, nodes.word)];
    let below = greys[grid_index(other, min(nodes.y + 1, parameters.height - 1), nodes.word)];
    return vec4(left, right, above, below);
}

// Whole bytes where the edge to the left, right, up or down is weak.
fn weak_edges(nodes: Nodes) -> vec4<u32> {
    if !WEAK {
        return vec4(0u);
    }
    let own = vec4(greys[grid_index(parameters.colour, nodes.y, nodes.word)]);
    let others = neighbour_greys(nodes);
    let smaller = minimum(own, others);
    let difference = (own ^ others ^ smaller) - smaller;
    // The excess over the threshold. The result has the eighth bit of each byte set where the excess is not zero.
    let excess = difference - minimum(difference, splat(parameters.edge_threshold));
    return spread((((excess & ~HIGH) + ~HIGH) | excess) & HIGH);
}

// One of two values for the edge to each side: the second if it is weak.
fn of_edges(weak_edges: vec4<u32>, usual: u32, weak: u32) -> vec4<u32> {
    if !WEAK {
        return splat(usual);
    }
    return (splat(usual) & ~weak_edges) | (splat(weak) & weak_edges);
}
