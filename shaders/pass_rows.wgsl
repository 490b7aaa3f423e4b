// Message passing under the schedule `sweep`: a pass through rows of bands. In each row the nodes of the leading colour send left,
// right and ahead, which is down or, backward, up. Then those of the following colour send ahead. The last row sends ahead
// only across a seam. A workgroup has a segment of a band.

@group(0) @binding(1) var<storage, read> leading_cost: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> following_cost: array<vec4<u32>>;
// What the following colour sent left, right and in the direction against the pass, before it.
@group(0) @binding(3) var<storage, read> sent_left: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> sent_right: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> sent_back: array<vec4<u32>>;
// What the pass sends. Above its first row is what the row there sent ahead before.
@group(0) @binding(6) var<storage, read_write> to_left: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> to_right: array<vec4<u32>>;
@group(0) @binding(8) var<storage, read_write> leading_ahead: array<vec4<u32>>;
@group(0) @binding(9) var<storage, read_write> following_ahead: array<vec4<u32>>;
// What a workgroup sent in this row and the last, in all the words that it computes: [workgroup][plane][quad][word].
@group(0) @binding(10) var<storage, read_write> own: array<vec4<u32>>;
// See edge_costs.wgsl.
@group(0) @binding(11) var<storage, read> edges: array<vec4<u32>>;

// The planes of `own`. What the leading colour sends ahead has one for rows of either parity, as the row before is still read.
const OWN_LEFT: u32 = 0;
const OWN_RIGHT: u32 = 1;
const OWN_FOLLOWING: u32 = 2;
const OWN_LEADING: u32 = 3;
const OWN_PLANES: u32 = 5;

// One colour's part of a row.
struct Turn {
    // The rows before this one.
    before: u32,
    leads: bool,
    sides: u32,
}

// A slice of a word, and where its vectors lie: in planes of the grid and, from a plane's first vector on, in planes of `own`.
struct Places {
    quad: u32,
    // The word, counted from the segment's first.
    word: u32,
    grid: vec4<u32>,
    own: vec4<u32>,
}

fn own_words() -> u32 {
    return min(MOST_WORDS, parameters.words);
}

fn own_plane(group: vec3<u32>, plane: u32) -> u32 {
    return (group.x * OWN_PLANES + plane) * parameters.quads * own_words();
}

fn own_at(at: vec4<u32>) -> Vectors {
    return Vectors(own[at.x], own[at.y], own[at.z], own[at.w]);
}

// What the leading colour sent right and left in this row. Beyond the ends of the segment, it is taken for zeros.

fn own_from_left_of(group: vec3<u32>, places: Places, nodes: Nodes) -> Vectors {
    let at = own_plane(group, OWN_RIGHT) + places.own;
    let aligned = own_at(at);
    if nodes.parity == 1 {
        return aligned;
    }
    let exists = places.word > 0;
    return one_later(aligned, own_at(at - vec4(select(0u, 1u, exists))), select(0u, 0xffffffffu, exists));
}

fn own_from_right_of(group: vec3<u32>, places: Places, nodes: Nodes, words: u32) -> Vectors {
    let at = own_plane(group, OWN_LEFT) + places.own;
    let aligned = own_at(at);
    if nodes.parity == 0 {
        return aligned;
    }
    let exists = places.word + 1 < words;
    return one_earlier(aligned, own_at(at + vec4(select(0u, 1u, exists))), select(0u, 0xffffffffu, exists));
}

// What the row before sent ahead, to nodes of this colour.
fn from_before(group: vec3<u32>, turn: Turn, places: Places) -> Vectors {
    if turn.before > 0 {
        let plane = select(OWN_LEADING + ((turn.before - 1) & 1), OWN_FOLLOWING, turn.leads);
        return own_at(own_plane(group, plane) + places.own);
    }
    let row = parameters.quads * parameters.words;
    let at = select(places.grid - vec4(row), places.grid + vec4(row), parameters.backward == 1);
    if turn.leads {
        return Vectors(following_ahead[at.x], following_ahead[at.y], following_ahead[at.z], following_ahead[at.w]);
    }
    return Vectors(leading_ahead[at.x], leading_ahead[at.y], leading_ahead[at.z], leading_ahead[at.w]);
}

// What the next row sent back, to nodes of the leading colour.
fn from_next(places: Places) -> Vectors {
    let row = parameters.quads * parameters.words;
    let at = select(places.grid + vec4(row), places.grid - vec4(row), parameters.backward == 1);
    return Vectors(sent_back[at.x], sent_back[at.y], sent_back[at.z], sent_back[at.w]);
}

// Data cost plus the messages from all sides but the one sent to, for the leading colour.
fn gather_leading(group: vec3<u32>, turn: Turn, side: u32, places: Places, nodes: Nodes) -> Slice {
    let at = places.grid;
    let data = Vectors(leading_cost[at.x], leading_cost[at.y], leading_cost[at.z], leading_cost[at.w]);
    let before = from_before(group, turn, places);
    switch side {
        case LEFT: {
            return add_all(data, before, from_next(places), from_right_of(at, nodes));
        }
        case RIGHT: {
            return add_all(data, before, from_next(places), from_left_of(at, nodes));
        }
        default: {
            return add_all(data, before, from_left_of(at, nodes), from_right_of(at, nodes));
        }
    }
}

// The same for the following colour, which sends only ahead.
fn gather_following(group: vec3<u32>, turn: Turn, places: Places, nodes: Nodes, words: u32) -> Slice {
    let at = places.grid;
    let data = Vectors(following_cost[at.x], following_cost[at.y], following_cost[at.z], following_cost[at.w]);
    let before = from_before(group, turn, places);
    return add_all(data, before, own_from_left_of(group, places, nodes), own_from_right_of(group, places, nodes, words));
}

fn store_own(quad: u32, at: vec4<u32>, words: Vectors) {
    if quad < parameters.quads {
        own[at.x] = words.first;
    }
    if quad + 1 < parameters.quads {
        own[at.y] = words.second;
    }
    if SLICE_QUADS == 4 && quad + 2 < parameters.quads {
        own[at.z] = words.third;
    }
    if SLICE_QUADS == 4 && quad + 3 < parameters.quads {
        own[at.w] = words.fourth;
    }
}

fn store_quad(turn: Turn, side: u32, at: u32, words: vec4<u32>) {
    if !turn.leads {
        following_ahead[at] = words;
        return;
    }
    switch side {
        case LEFT: {
            to_left[at] = words;
        }
        case RIGHT: {
            to_right[at] = words;
        }
        default: {
            leading_ahead[at] = words;
        }
    }
}

fn store(turn: Turn, side: u32, quad: u32, at: vec4<u32>, words: Vectors) {
    if quad < parameters.quads {
        store_quad(turn, side, at.x, words.first);
    }
    if quad + 1 < parameters.quads {
        store_quad(turn, side, at.y, words.second);
    }
    if SLICE_QUADS == 4 && quad + 2 < parameters.quads {
        store_quad(turn, side, at.z, words.third);
    }
    if SLICE_QUADS == 4 && quad + 3 < parameters.quads {
        store_quad(turn, side, at.w, words.fourth);
    }
}

// The plane of `own` for what is sent to a side.
fn own_plane_of(turn: Turn, side: u32) -> u32 {
    if !turn.leads {
        return OWN_FOLLOWING;
    }
    return select(OWN_LEADING + (turn.before & 1), side, side <= RIGHT);
}

// Sends from the nodes of a turn.
fn send(group: vec3<u32>, local: vec3<u32>, segment: Segment, turn: Turn) {
    let row = select(segment.row + turn.before, segment.row + segment.rows - 1 - turn.before, parameters.backward == 1);
    let colour = select(1 - parameters.colour, parameters.colour, turn.leads);
    let ahead = select(DOWN, UP, parameters.backward == 1);
    let items = segment.words * turn.sides;
    for (var first = 0u; first < items; first += GROUP_WORDS) {
        // Invocations without an item compute some, to meet the others at barriers, and store nothing.
        let item = min(first + local.x, items - 1);
        let index = item / segment.words;
        let side = select(ahead, index, turn.leads && index <= RIGHT);
        let word = item - index * segment.words;
        let nodes = nodes_of_row(row, segment.word + word, colour, first + local.x < items);
        let quad = SLICE_QUADS * local.y;
        let grid = places_of(plane_index(row, nodes.word), quad, parameters.words);
        let places = Places(quad, word, grid, places_of(word, quad, own_words()));
        var values: Slice;
        if turn.leads {
            values = gather_leading(group, turn, side, places, nodes);
        } else {
            values = gather_following(group, turn, places, nodes, segment.words);
        }
        let words = message(values, local, nodes, side);
        if nodes.exist {
            store_own(quad, own_plane(group, own_plane_of(turn, side)) + places.own, words);
            if keeps(segment, nodes.word) {
                store(turn, side, quad, grid, words);
            }
        }
        workgroupBarrier();
    }
    storageBarrier();
}

@compute @workgroup_size(GROUP_WORDS, SLICES)
fn pass_rows(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let segment = segment_of(group);
    for (var before = 0u; before < segment.rows; before++) {
        let sends_ahead = parameters.across == 1 || before + 1 < segment.rows;
        send(group, local, segment, Turn(before, true, select(2u, 3u, sends_ahead)));
        if sends_ahead {
            send(group, local, segment, Turn(before, false, 1));
        }
    }
}
