// The features that the profile compares, for every pixel of one image: its grey value, its census code or those of its
// channels, its colour, or its grey value and values derived from its neighbours.

@group(0) @binding(2) var<storage, read_write> values: array<u32>;

// The column dx columns away. Border columns repeat outward.
fn aside(x: u32, dx: i32) -> u32 {
    return u32(clamp(i32(x) + dx, 0, i32(parameters.width) - 1));
}

fn grey_aside(x: u32, dx: i32, row: u32) -> u32 {
    return grey(aside(x, dx), row);
}

// The value that the census transform compares: a channel, or the grey value.
fn lightness(x: u32, row: u32) -> vec3<u32> {
    if PROFILE == CENSUS_32 {
        return colour(x, row);
    }
    return vec3(grey(x, row), 0u, 0u);
}

// One bit for each of the eight neighbours, in row order from the highest bit: 1 if it is lighter (Zabih and Woodfill 1994).
// The codes of several channels are concatenated.
fn census(x: u32, row: u32) -> u32 {
    let centre = lightness(x, row);
    var codes = vec3(0u);
    for (var dy = -1; dy <= 1; dy++) {
        for (var dx = -1; dx <= 1; dx++) {
            if dx != 0 || dy != 0 {
                codes = 2 * codes + vec3<u32>(lightness(aside(x, dx), u32(i32(row) + dy)) > centre);
            }
        }
    }
    return codes.x | (codes.y << 8) | (codes.z << 16);
}

// The neighbours that the outer code compares, in order.
const OUTER = array(
    vec2(0, -4),
    vec2(0, -2),
    vec2(-4, 0),
    vec2(-2, 0),
    vec2(2, 0),
    vec2(4, 0),
    vec2(0, 2),
    vec2(0, 4),
);

// As census, for grey values two and four pixels away.
fn outer(x: u32, row: u32) -> u32 {
    let centre = grey(x, row);
    var offsets = OUTER;
    var code = 0u;
    for (var i = 0u; i < 8; i++) {
        code = 2 * code + u32(grey_aside(x, offsets[i].x, u32(i32(row) + offsets[i].y)) > centre);
    }
    return code;
}

// Grey value and horizontal gradient.
fn gradient(x: u32, row: u32) -> u32 {
    let gradient = (256 + grey_aside(x, 1, row) - grey_aside(x, -1, row)) / 2;
    return grey(x, row) | (gradient << 8);
}

// Grey value, and the least and the greatest value within half a pixel.
fn half_samples(x: u32, row: u32) -> u32 {
    let centre = grey(x, row);
    let left = (centre + grey_aside(x, -1, row) + 1) / 2;
    let right = (centre + grey_aside(x, 1, row) + 1) / 2;
    return centre | (min(centre, min(left, right)) << 8) | (max(centre, max(left, right)) << 16);
}

fn value(x: u32, row: u32) -> u32 {
    switch PROFILE {
        case THESIS: {
            return grey(x, row);
        }
        case CENSUS: {
            return census(x, row);
        }
        case CENSUS_16: {
            return census(x, row) | (outer(x, row) << 8);
        }
        case CENSUS_32: {
            return census(x, row) | (outer(x, row) << 24);
        }
        case GRADIENT: {
            return gradient(x, row);
        }
        case BIRCHFIELD_TOMASI: {
            return half_samples(x, row);
        }
        default: {
            let rgb = colour(x, row);
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
    values[y * parameters.width + x] = value(x, y + APRON);
}
