// Copies a buffer of `rows` rows of `words` vectors, to measure at what rate kernels can read and write a device's memory.

@group(0) @binding(1) var<storage, read_write> to: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> source: array<vec4<u32>>;

@compute @workgroup_size(64)
fn copy(@builtin(global_invocation_id) id: vec3<u32>) {
    for (var row = 0u; row < parameters.rows; row++) {
        to[row * parameters.words + id.x] = source[row * parameters.words + id.x];
    }
}
