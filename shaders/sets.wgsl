// Label sets, for the kernels that make and use them. Under label sets, the nodes of grids 1 and 0 may take only some labels.
//
// A set belongs to a patch: 64 columns of the rows of a band, or of those around a seam. [window][patch][word], where a
// window is a band or a seam, and the bits of a word are 32 labels, the lowest first.

const PATCH_COLUMNS: u32 = 64;
const BAND_ROWS: u32 = 32;
// The rows above and below a seam that prepare it.
const ROWS_ABOVE: u32 = 12;
const ROWS_BELOW: u32 = 4;

fn set_words() -> u32 {
    return (parameters.labels + 31) / 32;
}

fn patches() -> u32 {
    return (parameters.width + PATCH_COLUMNS - 1) / PATCH_COLUMNS;
}

// The window of row y of the grid.
fn window(y: u32) -> u32 {
    if parameters.seams == 1 {
        return (y + ROWS_ABOVE) / BAND_ROWS - 1;
    }
    return y / BAND_ROWS;
}
