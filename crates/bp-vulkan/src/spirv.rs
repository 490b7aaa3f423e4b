//! Translates WGSL to SPIR-V with naga.

use std::fmt;

use bp_gpu::{Kernel, Pipeline};
use naga::{
    ShaderStage,
    back::{
        PipelineConstants,
        pipeline_constants::process_overrides,
        spv::{self, Capability, ZeroInitializeWorkgroupMemoryMode},
    },
    proc::{BoundsCheckPolicies, BoundsCheckPolicy},
    valid::{Capabilities, ValidationFlags, Validator},
};

/// The SPIR-V of a kernel with these constants. The error is naga's message.
pub(crate) fn translate(pipeline: &Pipeline) -> Result<Vec<u32>, String> {
    let Pipeline { kernel, constants } = pipeline;
    translate_text(&kernel.source(), *kernel, constants).map_err(|error| format!("kernel {pipeline}: {error}"))
}

fn translate_text(text: &str, kernel: Kernel, constants: &[(&str, u32)]) -> Result<Vec<u32>, String> {
    let module = naga::front::wgsl::parse_str(text).map_err(|error| error.emit_to_string(text))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    let info = validator.validate(&module).map_err(|error| error.emit_to_string(text))?;
    let constants: PipelineConstants =
        constants.iter().map(|&(name, value)| (name.to_owned(), f64::from(value))).collect();
    let entry_point = (ShaderStage::Compute, kernel.name());
    let (module, info) = process_overrides(&module, &info, Some(entry_point), &constants).map_err(describe)?;
    let entry_point = spv::PipelineOptions { shader_stage: entry_point.0, entry_point: entry_point.1.to_owned() };
    let mut words = spv::write_vec(&module, &info, &options(), Some(&entry_point)).map_err(describe)?;
    narrow_barriers(&mut words);
    Ok(words)
}

/// Makes barriers order the memory that the invocations of a workgroup see, as WGSL asks. naga lets those of storage buffers order
/// that of the whole device, for which GPUs empty caches.
fn narrow_barriers(words: &mut [u32]) {
    const HEADER: usize = 5;
    const CONTROL_BARRIER: u32 = 224;
    let mut at = HEADER;
    while at < words.len() {
        let (length, code) = ((words[at] >> 16) as usize, words[at] & 0xffff);
        if code == CONTROL_BARRIER {
            // The scope of memory becomes that of execution.
            words[at + 2] = words[at + 1];
        }
        at += length.max(1);
    }
}

fn describe(error: impl fmt::Display) -> String {
    error.to_string()
}

/// Options for plain code without checks. The kernels need none: their loops end, and their indices stay within the
/// buffers. Variables start as zeros, because some kernels rely on it.
fn options() -> spv::Options<'static> {
    let unchecked = BoundsCheckPolicy::Unchecked;
    spv::Options {
        lang_version: (1, 3),
        flags: spv::WriterFlags::empty(),
        // Every device supports this. naga then emits plain code instead of special instructions.
        capabilities: Some([Capability::Shader].into_iter().collect()),
        bounds_check_policies: BoundsCheckPolicies {
            index: unchecked,
            buffer: unchecked,
            image_load: unchecked,
            binding_array: unchecked,
        },
        force_loop_bounding: false,
        // Kernels write what they read.
        zero_initialize_workgroup_memory: ZeroInitializeWorkgroupMemoryMode::None,
        ..spv::Options::default()
    }
}

#[cfg(test)]
mod tests {
    use std::{collections::HashSet, io::Write as _, process::Command};

    use bp_core::{Algorithm, Model, Plan, Profile, Schedule, Size};
    use bp_gpu::{Limits, Program, Shape};

    use super::*;

    /// Every pipeline that plans of all profiles, schedules and algorithms need.
    fn pipelines() -> HashSet<Pipeline> {
        let size = Size { width: 90, height: 70 };
        let limits = [Shape::Words, Shape::Slices].map(|shape| Limits { shape, ..Limits::roomy() });
        let settings = Schedule::ALL.into_iter().flat_map(|s| Algorithm::ALL.map(|a| a.settings(size, 9, 2, s)));
        let plans = settings.flat_map(|settings| Profile::ALL.map(|profile| (profile, settings)));
        let plans = plans.map(|(profile, settings)| Plan::new(size, Model::new(profile, 20).unwrap(), settings));
        let programs =
            plans.flat_map(|plan| limits.each_ref().map(|limits| Program::new(plan.as_ref().unwrap(), limits)));
        programs.flat_map(|program| program.unwrap().pipelines).collect()
    }

    /// Uses the Khronos validator (Debian: spirv-tools). Where GPUs are required, so is the validator.
    #[test]
    fn all_kernels_are_valid_spirv() {
        if let Err(error) = Command::new("spirv-val").arg("--version").output() {
            assert!(std::env::var_os("BP_REQUIRE_GPU").is_none(), "spirv-val: {error}");
            return eprintln!("skipped: spirv-val: {error}");
        }
        for pipeline in pipelines() {
            let words = translate(&pipeline).unwrap();
            let mut file = tempfile::NamedTempFile::new().unwrap();
            words.iter().for_each(|word| file.write_all(&word.to_le_bytes()).unwrap());
            let mut validator = Command::new("spirv-val");
            let output = validator.args(["--target-env", "vulkan1.2"]).arg(file.path()).output().unwrap();
            assert!(output.status.success(), "{pipeline}: {}", String::from_utf8_lossy(&output.stderr));
        }
    }

    const TEXT: &str = "
        override N: u32;
        @group(0) @binding(0) var<storage, read_write> values: array<u32>;
        @compute @workgroup_size(64) fn refine(@builtin(global_invocation_id) id: vec3<u32>) {
            values[id.x] += N;
        }";

    #[test]
    fn a_kernel_becomes_spirv_1_3() {
        let words = translate_text(TEXT, Kernel::Refine, &[("N", 3)]).unwrap();
        assert_eq!(words[..2], [0x0723_0203, 0x0001_0300]);
    }

    /// Of a barrier of storage buffers and one of workgroup memory.
    #[test]
    fn barriers_order_the_memory_of_a_workgroup_and_no_more() {
        let text = TEXT.replace("values[id.x] += N;", "values[id.x] += N; storageBarrier(); workgroupBarrier();");
        let words = translate_text(&text, Kernel::Refine, &[("N", 3)]).unwrap();
        let barriers: Vec<_> = words.windows(3).filter(|found| found[0] == 4 << 16 | 224).collect();
        assert!(barriers.len() == 2 && barriers.iter().all(|found| found[1] == found[2]), "{barriers:?}");
    }

    #[test]
    fn errors_name_what_is_wrong() {
        let unknown = translate_text(TEXT, Kernel::Refine, &[("M", 3)]).unwrap_err();
        assert!(unknown.contains('M'), "{unknown}");
        let missing = translate_text(TEXT, Kernel::Refine, &[]).unwrap_err();
        assert!(missing.contains('N'), "{missing}");
        let absent = translate_text(TEXT, Kernel::Coarsen, &[("N", 3)]).unwrap_err();
        assert!(absent.contains("entry point"), "{absent}");
        assert!(translate_text("fn", Kernel::Refine, &[]).is_err());
    }
}
