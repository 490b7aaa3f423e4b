// Labels that are decided next to others, for select_labels and decide_rows.

// Enough for 1024 labels and the padding of the last quad.
const LABEL_BITS: u32 = 11;

// Neighbours on one side with decided labels: the labels, which neighbours exist, and slope and truncation of the edges.
struct Beside {
    labels: vec4<u32>,
    exist: vec4<bool>,
    slopes: vec4<u32>,
    truncations: vec4<u32>,
}

// The smoothness cost of a label next to these neighbours.
fn smoothness(label: u32, beside: Beside) -> vec4<u32> {
    let apart = max(vec4(label), beside.labels) - min(vec4(label), beside.labels);
    return select(vec4(0u), min(beside.slopes * apart, beside.truncations), beside.exist);
}
