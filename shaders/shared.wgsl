// Shared by all kernels: the parameters of a dispatch, the layout of values, and arithmetic on four bytes at a time.
//
// The nodes of a grid are split by colour: x + y is even (colour 0) or odd (colour 1). One half-step of the schedule
// `checkerboard` computes the messages that the nodes of one colour send from those that the other colour sent. Node i
// of a row and colour has the column x = 2 i + parity, where parity = (y + colour) mod 2.
//
// A plane holds a byte for each label of each node of one colour: [row][quad][word] vec4<u32>. Each component of a
// vector is one of four consecutive labels (a quad). Its four bytes are four consecutive nodes (a word). So
// neighbouring invocations read neighbouring vectors, and one operation works on 16 values. All four neighbours of a
// node lie in the plane of the other colour, at most one byte away. The rows above the first and below the last row
// hold zeros, or a row of the adjacent strip.
//
// Bytes of nodes beyond the image's right border are zero in all planes. Labels that pad the last quad have data costs
// so high that they change no message.

struct Parameters {
    // The grid: its size in nodes, words in a row of a plane, labels and quads of labels.
    width: u32,
    height: u32,
    words: u32,
    labels: u32,
    quads: u32,
    // The strip: the row of the grid that is its row 0.
    first_row: u32,
    // The dispatch: the colour of its nodes, and its rows of the strip (row, row + row_step, ...) and their number. Under the schedule
    // `sweep`, bands take the place of rows, and `span` is the number of rows of each, apart from those beyond the strip.
    colour: u32,
    row: u32,
    row_step: u32,
    rows: u32,
    span: u32,
    // The rows of the strip.
    strip_rows: u32,
    // The model: slope and truncation of the smoothness cost and the smaller of the two, for each level of edges, the greatest
    // grey difference of each level, the value at which data costs are clipped, and the disparity of label 0.
    slopes: array<u32, 4>,
    truncations: array<u32, 4>,
    steps: array<u32, 4>,
    most: array<u32, 4>,
    clip: u32,
    min_disparity: i32,
    // The data cost of labels beyond the last one.
    padding_cost: u32,
    // The first column right of a cut and the first row below it; 0 without a cut.
    cut_x: u32,
    cut_y: u32,
    // update_messages under the schedule `sweep`: the sides to send to; bit 0 left, 1 right, 2 up, 3 down.
    sends: u32,
    // select_labels under the schedule `sweep`: 1 if the rows above have labels.
    labels_above: u32,
    // Kernels of label sets, and decide_rows: 1 if the sets or labels are those of seams, 0 if they are those of bands.
    seams: u32,
    // pass_rows and decide_rows: the first segment, and the words that each keeps.
    first_segment: u32,
    kept_words: u32,
    // pass_rows: 1 if the pass is backward, and 1 if its last row sends ahead too.
    backward: u32,
    across: u32,
    // envelope.wgsl: how many labels an offer may pass before it costs as much as the truncation.
    reach: u32,
    // refine and extend_messages: the side that the messages are sent to, with the same numbering.
    side: u32,
    // coarsen, coarsen_greys, refine and label_sets: size, words and strip of the grid that is read.
    other_width: u32,
    other_height: u32,
    other_words: u32,
    other_first_row: u32,
}

@group(0) @binding(0) var<storage, read> parameters: Parameters;

// The profile of the data cost.
const THESIS: u32 = 0;
const CENSUS: u32 = 1;
const MRF: u32 = 2;
const GRADIENT: u32 = 3;
const BIRCHFIELD_TOMASI: u32 = 4;
const CENSUS_16: u32 = 5;
const CENSUS_32: u32 = 6;
override PROFILE: u32 = THESIS;

const LEFT: u32 = 0;
const RIGHT: u32 = 1;
const UP: u32 = 2;
const DOWN: u32 = 3;

// Four consecutive nodes of one colour in a row.
struct Nodes {
    // The row in the strip and in the grid.
    row: u32,
    y: u32,
    // The word in the row, the colour and the parity of the columns.
    word: u32,
    colour: u32,
    parity: u32,
    // Whether this invocation has any nodes.
    exist: bool,
}

fn nodes(invocation: u32) -> Nodes {
    let line = invocation / parameters.words;
    return nodes_at(line, invocation - line * parameters.words);
}

// The nodes of a word in row `line` of the dispatch.
fn nodes_at(line: u32, word: u32) -> Nodes {
    var row = parameters.row + line * parameters.row_step;
    if parameters.span > 1 {
        row = parameters.row + line / parameters.span * parameters.row_step + line % parameters.span;
    }
    // Invocations that only meet others at barriers read no rows beyond the strip either.
    let exist = line < parameters.rows && row < parameters.strip_rows;
    return nodes_of_row(min(row, parameters.strip_rows - 1), word, parameters.colour, exist);
}

fn nodes_of_row(row: u32, word: u32, colour: u32, exist: bool) -> Nodes {
    let y = parameters.first_row + row;
    return Nodes(row, y, word, colour, (y + colour) & 1, exist);
}

// The columns of the four nodes.
fn columns(nodes: Nodes) -> vec4<u32> {
    return 8 * nodes.word + nodes.parity + vec4(0u, 2u, 4u, 6u);
}

// Index of a node's first quad in a plane. Further quads follow every `words` vectors.
fn plane_index(row: u32, word: u32) -> u32 {
    return (row + 1) * parameters.quads * parameters.words + word;
}

// Index of a word in a buffer of the whole grid: [colour][row][word].
fn grid_index(colour: u32, y: u32, word: u32) -> u32 {
    return (colour * parameters.height + y) * parameters.words + word;
}

// A mask of whole bytes from four conditions.
fn bytes_where(condition: vec4<bool>) -> u32 {
    let bytes = select(vec4(0u), vec4(0xffu, 0xff00u, 0xff0000u, 0xff000000u), condition);
    return bytes.x | bytes.y | bytes.z | bytes.w;
}

// A mask of the nodes that have a neighbour to send to on this side. Nodes beyond the right border need no mask: they cost nothing and
// receive zeros, so they send zeros.
fn receivers_at(nodes: Nodes, side: u32) -> u32 {
    let x = columns(nodes) + select(0u, 1u, side == RIGHT);
    let y = nodes.y + select(0u, 1u, side == DOWN);
    if side == LEFT || side == RIGHT {
        return bytes_where((x != vec4(0u)) & (x < vec4(parameters.width)) & (x != vec4(parameters.cut_x)));
    }
    return select(0u, 0xffffffffu, y != 0 && y < parameters.height && y != parameters.cut_y);
}

// The same for every side.
fn receivers(nodes: Nodes) -> vec4<u32> {
    return vec4(receivers_at(nodes, LEFT), receivers_at(nodes, RIGHT), receivers_at(nodes, UP), receivers_at(nodes, DOWN));
}

// The same byte four times.
fn splat(byte: u32) -> vec4<u32> {
    return vec4(byte * 0x01010101u);
}

// The four bytes of a word.
fn unpack(word: u32) -> vec4<u32> {
    return (vec4(word) >> vec4(0u, 8u, 16u, 24u)) & vec4(0xffu);
}

fn pack(bytes: vec4<u32>) -> u32 {
    return bytes.x + (bytes.y << 8) + (bytes.z << 16) + (bytes.w << 24);
}

const HIGH = vec4<u32>(0x80808080u);

// The highest bit of each byte, copied to all of its bits.
fn spread(high: vec4<u32>) -> vec4<u32> {
    return high | (high - (high >> vec4(7u)));
}

// The smaller of two bytes, for all 16. Subtracting the low seven bits with the eighth set never borrows from the next
// byte; the eighth bits decide, and where they are equal, the difference does.
fn minimum(a: vec4<u32>, b: vec4<u32>) -> vec4<u32> {
    let difference = (a | HIGH) - (b & ~HIGH);
    let not_less = spread(((a & ~b) | (~(a ^ b) & difference)) & HIGH);
    return (a & ~not_less) | (b & not_less);
}

// Whether sums of bytes may exceed 255 and must then saturate.
override SATURATING: bool = true;

// The sum of two bytes, for all 16.
fn sum(a: vec4<u32>, b: vec4<u32>) -> vec4<u32> {
    if !SATURATING {
        return a + b;
    }
    let low = (a & ~HIGH) + (b & ~HIGH);
    let over = ((a & b) | ((a | b) & low)) & HIGH;
    return (low ^ ((a ^ b) & HIGH)) | spread(over);
}
