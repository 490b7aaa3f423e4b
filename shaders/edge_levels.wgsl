// Finds the levels of edges by how much the grey values of their nodes differ. The kernel's `greys` holds the grey values of the whole
// grid: [colour][row][word], one byte per node.

// Whether the model has more than one level.
override LEVELS: bool = false;

// The grey values of the left, right, upper and lower neighbours, indexed like their messages. Missing neighbours have
// arbitrary values.
fn neighbour_greys(nodes: Nodes) -> vec4<u32> {
    let other = 1 - nodes.colour;
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

// Whole bytes where the edge to the left, right, up or down has at least the second, third and fourth level.
struct Levels {
    second: vec4<u32>,
    third: vec4<u32>,
    fourth: vec4<u32>,
}

// Whole bytes where a difference is greater than `most`.
fn exceeds(difference: vec4<u32>, most: u32) -> vec4<u32> {
    // The result has the eighth bit of each byte set where the excess is not zero.
    let excess = difference - minimum(difference, splat(most));
    return spread((((excess & ~HIGH) + ~HIGH) | excess) & HIGH);
}

fn edge_levels(nodes: Nodes) -> Levels {
    if !LEVELS {
        return Levels();
    }
    let own = vec4(greys[grid_index(nodes.colour, nodes.y, nodes.word)]);
    let others = neighbour_greys(nodes);
    let smaller = minimum(own, others);
    let difference = (own ^ others ^ smaller) - smaller;
    let most = parameters.most;
    return Levels(exceeds(difference, most[0]), exceeds(difference, most[1]), exceeds(difference, most[2]));
}

// One of two values for each byte: the second where the mask is set.
fn choose(usual: vec4<u32>, other: u32, mask: vec4<u32>) -> vec4<u32> {
    return (usual & ~mask) | (splat(other) & mask);
}

// The value of the level of the edge to each side.
fn of_edges(levels: Levels, values: array<u32, 4>) -> vec4<u32> {
    let first = splat(values[0]);
    if !LEVELS {
        return first;
    }
    let second = choose(first, values[1], levels.second);
    return choose(choose(second, values[2], levels.third), values[3], levels.fourth);
}
