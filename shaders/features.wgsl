// What the profile compares, of every pixel of one image: its grey value, its census code, or its colour.

// Red, green and blue bytes of all pixels, without gaps.
@group(0) @binding(1) var<storage, read> image: array<u32>;
@group(0) @binding(2) var<storage, read_write> values: array<u32>;

fn image_byte(index: u32) -> u32 {
    return (image[index / 4] >> (8 * (index % 4))) & 0xff;
}

fn colour(x: u32, y: u32) -> vec3<u32> {
    let first = 3 * (y * parameters.width + x);
    return vec3(image_byte(first), image_byte(first + 1), image_byte(first + 2));
}

// Luma in integers with the weights of ITU-R BT.601.
fn grey(x: u32, y: u32) -> u32 {
    let weighted = colour(x, y) * vec3(299u, 587u, 114u);
    return (weighted.x + weighted.y + weighted.z + 500) / 1000;
}

// A bit for each neighbour in row order, from the highest bit: whether it is lighter (Zabih and Woodfill 1994). Border
// pixels are repeated outward.
fn census(x: u32, y: u32) -> u32 {
    let columns = vec3(max(x, 1) - 1, x, min(x + 1, parameters.width - 1));
    let rows = vec3(max(y, 1) - 1, y, min(y + 1, parameters.height - 1));
    let centre = grey(x, y);
    var code = 0u;
    for (var j = 0; j < 3; j++) {
        for (var i = 0; i < 3; i++) {
            if i != 1 || j != 1 {
                code = 2 * code + u32(grey(columns[i], rows[j]) > centre);
            }
        }
    }
    return code;
}

fn value(x: u32, y: u32) -> u32 {
    switch PROFILE {
        case THESIS: {
            return grey(x, y);
        }
        case CENSUS: {
            return census(x, y);
        }
        default: {
            let rgb = colour(x, y);
            return rgb.r | (rgb.g << 8) | (rgb.b << 16);
        }
    }
}

@compute @workgroup_size(64)
fn features(@builtin(global_invocation_id) id: vec3<u32>) {
    let line = id.x / parameters.width;
    if line >= parameters.rows {
        return;
    }
    let x = id.x - line * parameters.width;
    let y = parameters.row + line;
    values[y * parameters.width + x] = value(x, y);
}
