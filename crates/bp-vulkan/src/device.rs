//! A device, ready to prepare plans.

use std::sync::{Arc, Mutex};

use bp_core::{Device, Error, IsStopped, Plan, Solver};
use bp_gpu::{GpuSolver, Limits, Program};

use crate::{adapter::Adapter, gpu::Gpu, instance::Instance, limits, pipelines::Pipelines, queue::VulkanQueue};

/// A device, ready to prepare plans. All plans share its compiled kernels.
pub(crate) struct VulkanDevice {
    gpu: Arc<Gpu>,
    pipelines: Mutex<Pipelines>,
    limits: Limits,
}

impl VulkanDevice {
    /// Opens a device. The error is the reason as text.
    pub(crate) fn open(instance: Instance, adapter: Adapter, change: impl FnOnce(&mut Limits)) -> Result<Self, String> {
        let gpu = Arc::new(Gpu::open(instance, adapter)?);
        let pipelines = Pipelines::new(&gpu).map_err(|error| error.to_string())?;
        let mut limits = limits::of(&gpu)?;
        change(&mut limits);
        Ok(Self { gpu, pipelines: Mutex::new(pipelines), limits })
    }

    /// Its limits, with memory limited to what is free now.
    fn limits(&self) -> Limits {
        let bytes = [self.limits.memory_bytes, limits::free_bytes(&self.gpu)];
        Limits { memory_bytes: bytes.into_iter().flatten().min(), ..self.limits.clone() }
    }
}

impl Device for VulkanDevice {
    fn prepare(&self, plan: &Plan, _: IsStopped<'_>) -> Result<Box<dyn Solver>, Error> {
        self.gpu.check()?;
        let program = Program::new(plan, &self.limits())?;
        let queue = VulkanQueue::new(&self.gpu, &self.pipelines, &program)?;
        Ok(Box::new(GpuSolver::new(plan, program, Box::new(queue))?))
    }

    fn check(&self, plan: &Plan) -> Result<(), Error> {
        Program::new(plan, &self.limits()).map(drop)
    }

    fn check_warm(&self, plan: &Plan) -> Result<(), Error> {
        bp_gpu::check_warm(plan)
    }

    fn planned_bytes(&self, plan: &Plan) -> u64 {
        Program::planned_bytes(plan, &self.limits)
    }

    fn copy_rate(&self) -> Result<Option<f64>, Error> {
        self.gpu.check()?;
        let rate = bp_gpu::copy_rate(&self.limits(), |program| {
            Ok(Box::new(VulkanQueue::new(&self.gpu, &self.pipelines, program)?))
        });
        rate.map(Some)
    }
}

#[cfg(test)]
mod tests {
    use bp_core::{Algorithm, Driver, Model, Profile, Schedule};
    use bp_testkit::noise_pair;

    use super::*;

    #[test]
    fn an_abandoned_device_refuses_work_and_is_left_alone() {
        let first = |instance: &Instance| Some(instance.adapters().ok()?.swap_remove(0));
        let Ok(instance) = Instance::new() else { return };
        let Some(adapter) = first(&instance) else { return };
        let device = VulkanDevice::open(instance, adapter, |_| ()).unwrap();
        let pair = noise_pair(4, 3, 1);
        let settings = Algorithm::Bp.settings(pair.size(), 1, 1, Schedule::Sync);
        let plan = Plan::new(pair.size(), Model::new(Profile::Thesis, 3).unwrap(), settings).unwrap();
        let mut driver = Driver::new(&device, plan.clone()).unwrap();
        device.gpu.abandon();
        assert!(matches!(driver.solve(&pair), Err(Error::DeviceLost { .. })));
        assert!(matches!(device.prepare(&plan, &bp_core::never).err(), Some(Error::DeviceLost { .. })));
        drop(device);
        drop(driver);
    }
}
