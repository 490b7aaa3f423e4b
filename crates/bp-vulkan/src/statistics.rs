//! What a driver's compiler says of kernels: instructions, registers, how many can run at a time.
//!
//! This needs no memory of the device, so it also works for GPUs that are not there: Mesa's driver RADV compiles for any AMD GPU
//! that the variable RADV_FORCE_FAMILY names.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::sync::Arc;

use ash::{khr::pipeline_executable_properties, vk};
use bp_core::{Backend, Error, Plan};
use bp_gpu::{Limits, Pipeline, Program, Shape};

use crate::{
    Vulkan,
    adapter::text,
    gpu::Gpu,
    instance::Instance,
    pick,
    pipelines::{compile, lay_out},
};

/// What the compiler says of a kernel.
#[derive(Clone, Debug)]
pub struct Statistics {
    /// The kernel.
    pub pipeline: Pipeline,
    /// The name of each figure and its value. Drivers have names of their own.
    pub figures: Vec<(String, f64)>,
}

/// Compiles all kernels of a plan, in this shape, for a device, by its index in [`Backend::devices`]. Returns what its compiler says
/// of them.
///
/// # Errors
/// [`Error::Unavailable`] if the device cannot be opened, or tells no figures ([`VK_KHR_pipeline_executable_properties`]);
/// [`Error::Device`] if a kernel does not compile.
///
/// [`VK_KHR_pipeline_executable_properties`]: https://docs.vulkan.org/refpages/latest/refpages/source/VK_KHR_pipeline_executable_properties.html
pub fn statistics(device: usize, plan: &Plan, shape: Shape) -> Result<Vec<Statistics>, Error> {
    let gpu = open(device).map_err(|reason| Error::Unavailable { backend: Vulkan.name(), device, reason })?;
    let gpu = Arc::new(gpu);
    let calls = pipeline_executable_properties::Device::new(gpu.instance().raw(), gpu.raw());
    let program = Program::new(plan, &Limits { shape, ..Limits::roomy() })?;
    let of =
        |pipeline: &Pipeline| Ok(Statistics { pipeline: pipeline.clone(), figures: figures(&gpu, &calls, pipeline)? });
    program.pipelines.iter().map(of).collect()
}

/// Opens a device that tells figures.
fn open(device: usize) -> Result<Gpu, String> {
    let instance = Instance::new()?;
    let adapter = pick(instance.adapters()?, device)?;
    let name = pipeline_executable_properties::NAME;
    if !adapter.has_extension(instance.raw(), name) {
        return Err(format!(
            "{} tells no statistics of kernels: it lacks {}",
            adapter.info.name,
            text(Ok::<_, ()>(name))
        ));
    }
    let mut features =
        vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
    let extensions = [name.as_ptr()];
    let info = vk::DeviceCreateInfo::default().enabled_extension_names(&extensions).push_next(&mut features);
    Gpu::open_with(instance, adapter, info)
}

/// The figures of one kernel.
fn figures(
    gpu: &Arc<Gpu>,
    calls: &pipeline_executable_properties::Device,
    pipeline: &Pipeline,
) -> Result<Vec<(String, f64)>, Error> {
    let layout = lay_out(gpu, pipeline.kernel)?;
    let flags = vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR;
    let compiled = compile(gpu, vk::PipelineCache::null(), layout.pipeline.raw, pipeline, flags)?;
    let info = vk::PipelineExecutableInfoKHR::default().pipeline(compiled.raw);
    // SAFETY: the pipeline was made with the flag, and has one executable, as every compute pipeline. The structure is alive.
    let told = unsafe { calls.get_pipeline_executable_statistics(&info) };
    let told = gpu.checked("reading statistics of a kernel", told)?;
    Ok(told.iter().map(|figure| (text(figure.name_as_c_str()), value(figure))).collect())
}

fn value(figure: &vk::PipelineExecutableStatisticKHR<'_>) -> f64 {
    // SAFETY: the format says which of the fields is set; the others have as many bytes or fewer.
    unsafe {
        match figure.format {
            vk::PipelineExecutableStatisticFormatKHR::BOOL32 => f64::from(figure.value.b32),
            vk::PipelineExecutableStatisticFormatKHR::INT64 => figure.value.i64 as f64,
            vk::PipelineExecutableStatisticFormatKHR::UINT64 => figure.value.u64 as f64,
            _ => figure.value.f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use bp_core::{Algorithm, Model, Profile, Schedule, Size};

    use super::*;

    #[test]
    fn a_device_tells_of_every_kernel_or_says_why_not() {
        let size = Size { width: 8, height: 6 };
        let settings = Algorithm::Cfbp.settings(size, 2, 2, Schedule::Checkerboard);
        let plan = Plan::new(size, Model::new(Profile::Census, 4).unwrap(), settings).unwrap();
        for device in 0..Vulkan.devices().len() {
            match statistics(device, &plan, Shape::Words) {
                Ok(all) => assert!(all.iter().any(|of| of.pipeline.to_string().starts_with("update_messages"))),
                Err(error) => assert!(error.to_string().contains("VK_KHR_pipeline_executable_properties"), "{error}"),
            }
        }
        assert!(matches!(statistics(99, &plan, Shape::Words), Err(Error::Unavailable { device: 99, .. })));
    }
}
