// Shares out the labels of nodes: in a workgroup, GROUP_WORDS words of nodes have SLICES invocations each, and each of these
// computes a slice of the labels. Processors compute all labels of a word in one invocation.

override GROUP_WORDS: u32 = 64;
override SLICES: u32 = 1;

// The nodes of an invocation. Those that have none get other invocations' nodes, so that they meet them at barriers, and must not
// store anything.
fn nodes_of(group: vec3<u32>, local: vec3<u32>) -> Nodes {
    let item = group.x * GROUP_WORDS + local.x;
    let line = item / parameters.words;
    var nodes = nodes_at(min(line, parameters.rows - 1), item - line * parameters.words);
    nodes.exist &= line < parameters.rows;
    return nodes;
}

// The first quad of a slice, and the one behind its last.
fn quads_of(slice: u32) -> vec2<u32> {
    let quads = (parameters.quads + SLICES - 1) / SLICES;
    return min(vec2(slice, slice + 1) * quads, vec2(parameters.quads));
}

// [side][node][word], so that neighbouring invocations use different banks of memory. (naga 30 cannot compute an array's length.)
var<workgroup> leasts: array<array<atomic<u32>, 16>, GROUP_WORDS>;

// The least value over all slices, for each node of a word and, in update_messages_of_slice, for each side. All invocations of a
// workgroup must call it.
fn least_of_slices(local: vec3<u32>, own: vec4<u32>) -> vec4<u32> {
    if SLICES == 1 {
        return own;
    }
    let places = (4 * local.z + vec4(0u, 1u, 2u, 3u)) * GROUP_WORDS + local.x;
    if local.y == 0 {
        for (var i = 0u; i < 4; i++) {
            atomicStore(&leasts[places[i] / 16][places[i] % 16], own[i]);
        }
    }
    workgroupBarrier();
    if local.y > 0 {
        for (var i = 0u; i < 4; i++) {
            atomicMin(&leasts[places[i] / 16][places[i] % 16], own[i]);
        }
    }
    workgroupBarrier();
    var least: vec4<u32>;
    for (var i = 0u; i < 4; i++) {
        least[i] = atomicLoad(&leasts[places[i] / 16][places[i] % 16]);
    }
    return least;
}
