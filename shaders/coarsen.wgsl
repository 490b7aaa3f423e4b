// Data costs of a coarser grid. A node sums the costs of its children, four at most, label by label.

// The finer grid's nodes of colour 0 and 1: their stored costs, which are read if never clipped, and their sums.
@group(0) @binding(3) var<storage, read> even_costs: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> odd_costs: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> even_sums: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read> odd_sums: array<vec2<u32>>;

// The bytes of the finer grid's sums; 0 to read its stored costs instead.
override FINE_SUM_BYTES: u32 = 0;

// Two of a word's four 16-bit sums: those of nodes `parity` and `parity + 2`.
fn halves(word: vec2<u32>, parity: u32) -> vec2<u32> {
    return (word >> vec2(16 * parity)) & vec2(0xffffu);
}

// Costs of one label of a quad at nodes `parity` and `parity + 2` of a finer word. `index` counts vectors.
fn fine_sums(colour: u32, index: u32, label: u32, parity: u32) -> vec2<u32> {
    let at = 4 * index + label;
    if FINE_SUM_BYTES == 2 {
        if colour == 0 {
            return halves(even_sums[at], parity);
        }
        return halves(odd_sums[at], parity);
    }
    if colour == 0 {
        return vec2(even_sums[2 * at][parity], even_sums[2 * at + 1][parity]);
    }
    return vec2(odd_sums[2 * at][parity], odd_sums[2 * at + 1][parity]);
}

// Costs of a quad of labels at these two nodes, one vector of labels per node.
struct Pair {
    first: vec4<u32>,
    second: vec4<u32>,
}

fn fine_pair(colour: u32, index: u32, parity: u32) -> Pair {
    if FINE_SUM_BYTES == 0 {
        var bytes: vec4<u32>;
        if colour == 0 {
            bytes = even_costs[index];
        } else {
            bytes = odd_costs[index];
        }
        bytes = bytes >> vec4(8 * parity);
        return Pair(bytes & vec4(0xffu), (bytes >> vec4(16u)) & vec4(0xffu));
    }
    let a = fine_sums(colour, index, 0, parity);
    let b = fine_sums(colour, index, 1, parity);
    let c = fine_sums(colour, index, 2, parity);
    let d = fine_sums(colour, index, 3, parity);
    return Pair(vec4(a.x, b.x, c.x, d.x), vec4(a.y, b.y, c.y, d.y));
}

// Coarse column X has the fine columns 2 X and 2 X + 1. The first has colour 0 in an even row and colour 1 in an odd
// row. Both are node X of their row and colour. So the children of the coarse nodes 2 i + parity of a word lie in two
// words, at bytes parity and parity + 2.
fn children(nodes: Nodes, quad: u32) -> array<vec4<u32>, 4> {
    var at: array<vec4<u32>, 4>;
    for (var child_row = 0u; child_row < 2; child_row++) {
        // The row below the last one holds zeros.
        let row = 2 * nodes.y + child_row - parameters.other_first_row;
        for (var half = 0u; half < 2; half++) {
            let word = 2 * nodes.word + half;
            if word < parameters.other_words {
                let index = ((row + 1) * parameters.quads + quad) * parameters.other_words + word;
                for (var colour = 0u; colour < 2; colour++) {
                    let pair = fine_pair(colour, index, nodes.parity);
                    at[2 * half] += pair.first;
                    at[2 * half + 1] += pair.second;
                }
            }
        }
    }
    return at;
}

// Costs of four labels at four nodes, one vector of nodes per label.
fn by_label(at: array<vec4<u32>, 4>) -> array<vec4<u32>, 4> {
    return array(
        vec4(at[0].x, at[1].x, at[2].x, at[3].x),
        vec4(at[0].y, at[1].y, at[2].y, at[3].y),
        vec4(at[0].z, at[1].z, at[2].z, at[3].z),
        vec4(at[0].w, at[1].w, at[2].w, at[3].w),
    );
}

@compute @workgroup_size(GROUP_WORDS, SLICES)
fn coarsen(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let nodes = nodes_of(group, local);
    let quads = quads_of(local.y);
    var least = vec4(0xffffffffu);
    for (var quad = quads.x; quad < quads.y; quad++) {
        let costs = by_label(children(nodes, quad));
        for (var i = 0u; i < 4; i++) {
            if 4 * quad + i < parameters.labels {
                least = min(least, costs[i]);
            }
        }
    }
    least = least_of_slices(local, least);
    if !nodes.exist {
        return;
    }
    for (var quad = quads.x; quad < quads.y; quad++) {
        store(nodes, quad, by_label(children(nodes, quad)), least);
    }
}
