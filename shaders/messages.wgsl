// Reads the data costs of the nodes of one colour and the messages that they received from the other colour, for
// kernels that update messages and for select_labels.

@group(0) @binding(1) var<storage, read> cost: array<vec4<u32>>;
// The messages that all nodes of the other colour sent to their left, right, upper and lower neighbours.
@group(0) @binding(2) var<storage, read> sent_left: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> sent_right: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> sent_up: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> sent_down: array<vec4<u32>>;

// The messages from each side, for a quad of labels. In its row and colour, a neighbour has the same index as the node,
// with two exceptions: the left neighbour of an even column has the previous index, and the right neighbour of an odd
// column has the next one.

fn from_left(index: u32, nodes: Nodes) -> vec4<u32> {
    let aligned = sent_right[index];
    if nodes.parity == 1 {
        return aligned;
    }
    var before = vec4(0u);
    if nodes.word > 0 {
        before = sent_right[index - 1];
    }
    return (aligned << vec4(8u)) | (before >> vec4(24u));
}

fn from_right(index: u32, nodes: Nodes) -> vec4<u32> {
    let aligned = sent_left[index];
    if nodes.parity == 0 {
        return aligned;
    }
    var behind = vec4(0u);
    if nodes.word + 1 < parameters.words {
        behind = sent_left[index + 1];
    }
    return (aligned >> vec4(8u)) | (behind << vec4(24u));
}

fn from_above(index: u32) -> vec4<u32> {
    return sent_down[index - parameters.quads * parameters.words];
}

fn from_below(index: u32) -> vec4<u32> {
    return sent_up[index + parameters.quads * parameters.words];
}
