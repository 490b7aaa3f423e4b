// Segments, for the kernels that go through the rows of bands one after another. A segment is some words of a band's rows, and
// belongs to a workgroup.
//
// What a node computes depends on its neighbours in the row before. So in n rows, what a segment does not know beyond its ends
// spoils up to n columns at either end. Therefore it computes as many more as that, and keeps the others.

// The most words that a segment computes.
override MOST_WORDS: u32 = 20;

const WORD_COLUMNS: u32 = 8;

struct Segment {
    // The first of its rows in the strip, and their number.
    row: u32,
    rows: u32,
    // The first of the words that it computes, and their number.
    word: u32,
    words: u32,
    // The first word that it keeps, and the one behind the last.
    kept: vec2<u32>,
}

fn segment_of(group: vec3<u32>) -> Segment {
    let index = parameters.first_segment + group.x;
    let in_a_row = (parameters.words + parameters.kept_words - 1) / parameters.kept_words;
    let band = index / in_a_row;
    let start = (index - band * in_a_row) * parameters.kept_words;
    let end = min(start + parameters.kept_words, parameters.words);
    let spoilt = (parameters.span + WORD_COLUMNS - 1) / WORD_COLUMNS;
    let word = max(start, spoilt) - spoilt;
    let row = parameters.row + band * parameters.row_step;
    let rows = min(parameters.span, parameters.strip_rows - row);
    return Segment(row, rows, word, min(end + spoilt, parameters.words) - word, vec2(start, end));
}

fn keeps(segment: Segment, word: u32) -> bool {
    return word >= segment.kept.x && word < segment.kept.y;
}
