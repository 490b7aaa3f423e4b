// Messages from the nodes of one colour to one side, with values for all labels: the least M(e) + s |d - e| over the labels e
// of the receiver's set, truncated. Two passes compute it, as in update_messages.

@group(0) @binding(1) var<storage, read_write> messages: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> sets: array<u32>;

// The sets of the receivers of four nodes, and whether a message is sent: columns that only fill up the last word have
// neighbours too.
struct Receivers {
    sets: vec4<u32>,
    exist: u32,
}

fn receiving(nodes: Nodes) -> Receivers {
    var x = vec4<i32>(columns(nodes));
    var y = i32(nodes.y);
    let width = vec4(i32(parameters.width));
    let sends = x < width;
    switch parameters.side {
        case LEFT: {
            x -= 1;
        }
        case RIGHT: {
            x += 1;
        }
        case UP: {
            y -= 1;
        }
        default: {
            y += 1;
        }
    }
    let inside = sends & (x >= vec4(0)) & (x < width) & vec4(y >= 0 && y < i32(parameters.height));
    let patch_index = vec4<u32>(max(x, vec4(0))) / PATCH_COLUMNS;
    let at = window(u32(max(y, 0))) * patches() + min(patch_index, vec4(patches() - 1));
    return Receivers(at * set_words(), bytes_where(inside));
}

// Whole bytes where a label is in the set of a receiver.
fn in_sets(receivers: Receivers, label: u32) -> u32 {
    if label >= parameters.labels {
        return 0;
    }
    let at = receivers.sets + label / 32;
    let words = vec4(sets[at.x], sets[at.y], sets[at.z], sets[at.w]);
    return bytes_where(((words >> vec4(label % 32)) & vec4(1u)) == vec4(1u));
}

@compute @workgroup_size(64)
fn extend_messages(@builtin(global_invocation_id) id: vec3<u32>) {
    let nodes = nodes(id.x);
    if !nodes.exist {
        return;
    }
    let to = receiving(nodes);
    let first = plane_index(nodes.row, nodes.word);
    let step = splat(parameters.steps[0]);
    var offer = vec4(0xffffffffu);
    for (var quad = 0u; quad < parameters.quads; quad++) {
        let index = first + quad * parameters.words;
        var h = messages[index];
        for (var i = 0u; i < 4; i++) {
            h[i] |= ~in_sets(to, 4 * quad + i);
            h[i] = minimum(vec4(h[i]), offer).x;
            offer = sum(vec4(h[i]), step);
        }
        messages[index] = h;
    }
    offer = vec4(0xffffffffu);
    for (var quad = parameters.quads; quad > 0; quad--) {
        let index = first + (quad - 1) * parameters.words;
        var h = messages[index];
        for (var i = 4u; i > 0; i--) {
            h[i - 1] = minimum(vec4(h[i - 1]), offer).x;
            offer = sum(vec4(h[i - 1]), step);
        }
        messages[index] = minimum(h, splat(parameters.truncations[0])) & vec4(to.exist);
    }
}
