//! An open adapter.

use std::sync::Arc;

use bp_core::{Device, Error, IsStopped, Plan, Solver};
use bp_gpu::{GpuSolver, Limits, Program, Shape};
use wgpu::{Adapter, DeviceDescriptor, Features, MemoryHints};

use crate::{
    clock::Clock,
    gpu::{Gpu, caught},
    instance,
    pipelines::Pipelines,
    queue::WgpuQueue,
    vulkan,
};

/// An open adapter.
pub(crate) struct WgpuDevice {
    gpu: Arc<Gpu>,
    adapter: Adapter,
    limits: Limits,
    pipelines: Pipelines,
}

impl WgpuDevice {
    /// Opens an adapter with all its limits, modified by `change`. The error is the reason as text.
    pub(crate) fn open(adapter: &Adapter, change: impl FnOnce(&mut Limits)) -> Result<Self, String> {
        let descriptor = DeviceDescriptor {
            label: None,
            required_features: adapter.features() & (Clock::FEATURES | Features::PIPELINE_CACHE),
            required_limits: adapter.limits(),
            // We allocate a few large buffers. Blocks to suballocate from would only waste memory.
            memory_hints: MemoryHints::MemoryUsage,
            ..DeviceDescriptor::default()
        };
        // wgpu panics if it cannot allocate what a new device needs.
        let opened = caught(|| pollster::block_on(adapter.request_device(&descriptor)))?;
        let (device, queue) = opened.map_err(|error| error.to_string())?;
        let mut limits = limits(adapter)?;
        change(&mut limits);
        let gpu = Arc::new(Gpu::new(limits.device.clone(), device, queue));
        let pipelines = Pipelines::new(&gpu, adapter).map_err(|error| error.to_string())?;
        Ok(Self { gpu, adapter: adapter.clone(), limits, pipelines })
    }

    /// Its limits, with memory limited to what is free now. Drivers allow more, but then swap or end the program.
    fn limits(&self) -> Limits {
        let bytes = [self.limits.memory_bytes, vulkan::free_bytes(&self.adapter)];
        Limits { memory_bytes: bytes.into_iter().flatten().min(), ..self.limits.clone() }
    }
}

fn limits(adapter: &Adapter) -> Result<Limits, String> {
    let limits = adapter.limits();
    Ok(Limits {
        device: adapter.get_info().name,
        binding_bytes: limits.max_storage_buffer_binding_size,
        buffer_bytes: limits.max_buffer_size,
        bindings: limits.max_storage_buffers_per_shader_stage,
        workgroups: limits.max_compute_workgroups_per_dimension,
        invocations: limits.max_compute_invocations_per_workgroup,
        memory_bytes: vulkan::memory_bytes(adapter),
        shape: Shape::of(instance::kind(adapter))?,
        dispatch_entries: Limits::dispatch_entries(instance::kind(adapter)),
    })
}

impl Device for WgpuDevice {
    fn prepare(&self, plan: &Plan, _: IsStopped<'_>) -> Result<Box<dyn Solver>, Error> {
        let program = Program::new(plan, &self.limits())?;
        let queue = WgpuQueue::new(&self.gpu, &self.pipelines, &program)?;
        Ok(Box::new(GpuSolver::new(plan, program, Box::new(queue))?))
    }

    fn check(&self, plan: &Plan) -> Result<(), Error> {
        Program::new(plan, &self.limits()).map(drop)
    }

    fn check_warm(&self, plan: &Plan) -> Result<(), Error> {
        bp_gpu::check_warm(plan)
    }

    fn planned_bytes(&self, plan: &Plan) -> u64 {
        // Host memory holds a second copy of the upload buffer; see `WgpuQueue`.
        let upload = Program::new(plan, &self.limits).map_or(0, |program| program.buffers[Program::UPLOAD].bytes);
        Program::planned_bytes(plan, &self.limits).saturating_add(upload)
    }

    fn copy_rate(&self) -> Result<Option<f64>, Error> {
        let rate = bp_gpu::copy_rate(&self.limits(), |program| {
            Ok(Box::new(WgpuQueue::new(&self.gpu, &self.pipelines, program)?))
        });
        rate.map(Some)
    }
}

#[cfg(test)]
mod tests {
    use bp_core::{Algorithm, Driver, Model, Profile, Schedule};
    use bp_testkit::noise_pair;

    use super::*;

    /// The first device, if there is one.
    fn device() -> Option<WgpuDevice> {
        WgpuDevice::open(instance::adapters().ok()?.first()?, |_| ()).ok()
    }

    #[test]
    fn a_lost_device_is_an_error() -> Result<(), Error> {
        let Some(device) = device() else { return Ok(()) };
        let pair = noise_pair(9, 7, 1);
        let settings = Algorithm::Cfbp.settings(pair.size(), 5, 2, Schedule::Checkerboard);
        let plan = Plan::new(pair.size(), Model::new(Profile::Mrf, 8)?, settings)?;
        let mut driver = Driver::new(&device, plan.clone())?;
        driver.solve(&pair)?;
        device.gpu.device.destroy();
        assert!(matches!(driver.solve(&pair), Err(Error::DeviceLost { .. })));
        assert!(matches!(Driver::new(&device, plan).err(), Some(Error::DeviceLost { .. })));
        Ok(())
    }

    #[test]
    fn what_wgpu_refuses_is_an_error() {
        let Some(device) = device() else { return };
        let refused =
            device.gpu.guard(0, || Ok(crate::buffers::buffer(&device.gpu, "", 4, wgpu::BufferUsages::empty())));
        assert!(matches!(refused, Err(Error::Device { .. })));
        assert_eq!(device.gpu.guard(0, || Ok(())), Ok(()));
        let panicked = device.gpu.guard(0, || -> Result<(), Error> { panic!("as it does") });
        let lost =
            |result| matches!(result, Err(Error::DeviceLost { reason, .. }) if reason == "wgpu panicked: as it does");
        assert!(lost(panicked));
        assert!(lost(device.gpu.guard(0, || Ok(()))));
    }
}
