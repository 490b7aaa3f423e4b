// The bytes of an image, for features and greys.

// The red, green and blue bytes of all pixels, without gaps, including APRON rows above and below the image.
@group(0) @binding(1) var<storage, read> image: array<u32>;

override APRON: u32 = 4;

// The columns to the left of the nodes.
override MARGIN: u32 = 0;

fn image_byte(index: u32) -> u32 {
    return (image[index / 4] >> (8 * (index % 4))) & 0xff;
}

// The colour of a pixel. Its row is counted from the first row of the apron, its column from the first one behind the margin.
fn colour(x: u32, row: u32) -> vec3<u32> {
    let first = 3 * (row * (MARGIN + parameters.width) + MARGIN + x);
    return vec3(image_byte(first), image_byte(first + 1), image_byte(first + 2));
}

// Luma in integers with the weights of ITU-R BT.601.
fn grey(x: u32, row: u32) -> u32 {
    let weighted = colour(x, row) * vec3(299u, 587u, 114u);
    return (weighted.x + weighted.y + weighted.z + 500) / 1000;
}
