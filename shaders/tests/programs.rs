//! Programs stay within a device's limits, whatever these are, and leave no node out.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::collections::HashMap;

use bp_core::{Algorithm, Error, Model, Plan, Profile, Schedule, Settings, Size};
use bp_shaders::{Command, Kernel, Limits, Parameters, Program};

fn roomy() -> Limits {
    Limits {
        device: "a device".to_owned(),
        binding_bytes: 1 << 32,
        buffer_bytes: 1 << 32,
        bindings: 16,
        workgroups: 65_535,
        memory_bytes: None,
        dispatch_entries: 1 << 30,
    }
}

fn plan(size: Size, algorithm: Algorithm, schedule: Schedule, profile: Profile) -> Plan {
    Plan::new(size, Model::new(profile, 30).unwrap(), algorithm.settings(size, 20, 2, schedule)).unwrap()
}

fn plans() -> impl Iterator<Item = Plan> {
    let sizes = [(1, 1), (7, 3), (97, 130), (200, 301)].map(|(width, height)| Size { width, height });
    let schedules = Schedule::ALL.into_iter().flat_map(|s| Algorithm::ALL.map(|a| (a, s)));
    let with_sizes = schedules.flat_map(move |(a, s)| sizes.map(|size| (size, a, s)));
    with_sizes.flat_map(|(size, a, s)| Profile::ALL.map(|profile| plan(size, a, s, profile)))
}

struct Dispatch {
    kernel: Kernel,
    parameters: Parameters,
    workgroups: u32,
}

fn dispatches(program: &Program) -> impl Iterator<Item = Dispatch> {
    program.segments.iter().flat_map(|segment| &segment.commands).filter_map(|command| {
        let &Command::Dispatch { pipeline, parameters, workgroups, bind_group } = command else { return None };
        let kernel = program.pipelines[pipeline].kernel;
        assert_eq!(program.bind_groups[bind_group].kernel, kernel);
        assert_eq!(program.bind_groups[bind_group].buffers.len(), kernel.bindings().len());
        let block = &program.parameters[parameters as usize..][..size_of::<Parameters>()];
        Some(Dispatch { kernel, parameters: bytemuck::pod_read_unaligned(block), workgroups })
    })
}

#[test]
fn no_dispatch_and_no_buffer_passes_a_limit() {
    let tight = Limits { binding_bytes: 600_000, workgroups: 7, dispatch_entries: 1 << 16, ..roomy() };
    let mut cut = 0;
    for plan in plans() {
        let program = Program::new(&plan, &tight).unwrap();
        assert!(
            program
                .bind_groups
                .iter()
                .flat_map(|group| &group.buffers)
                .all(|&buffer| program.buffers[buffer].bytes <= tight.binding_bytes),
            "{plan:?}"
        );
        for Dispatch { kernel, parameters, workgroups } in dispatches(&program) {
            assert!(workgroups <= 7, "{kernel:?} {plan:?}");
            // An invocation of refine makes one message at eight nodes, one of update_messages four at four.
            let invocations = if kernel == Kernel::Refine { parameters.words.div_ceil(2) } else { parameters.words };
            let entries = u64::from(parameters.rows * invocations * 16 * parameters.labels);
            assert!(entries <= tight.dispatch_entries || parameters.rows == 1, "{kernel:?} {plan:?}");
            cut += u32::from(parameters.first_row > 0);
        }
    }
    assert!(cut > 0, "no grid was cut into strips");
}

/// Every row of every colour is computed once by the kernels that compute all of them, with any limits.
#[test]
fn every_row_is_computed_once() {
    let tight = Limits { binding_bytes: 600_000, workgroups: 7, dispatch_entries: 1 << 16, ..roomy() };
    for (plan, limits) in plans().flat_map(|plan| [(plan.clone(), roomy()), (plan, tight.clone())]) {
        let program = Program::new(&plan, &limits).unwrap();
        let mut rows: HashMap<(Kernel, u32, u32, u32), u32> = HashMap::new();
        let whole = [Kernel::Features, Kernel::MatchCost, Kernel::Coarsen, Kernel::SelectLabels];
        for Dispatch { kernel, parameters: p, .. } in dispatches(&program).filter(|d| whole.contains(&d.kernel)) {
            for row in (0..p.rows).map(|i| p.first_row + p.row + i * p.row_step) {
                *rows.entry((kernel, p.width, row, p.colour)).or_default() += 1;
            }
        }
        let height = |grid: usize| plan.size(grid).height;
        let coarse: usize = (1..plan.grids()).map(height).sum();
        // Coarsest grids may have the same width; then their rows count together.
        let computed: u32 = rows.values().sum();
        assert_eq!(computed as usize, 2 * (3 * height(0) + coarse), "{plan:?}");
        for (&(kernel, _, row, colour), &count) in rows.iter().filter(|((kernel, ..), _)| *kernel != Kernel::Coarsen) {
            let images = if kernel == Kernel::Features { 2 } else { 1 };
            assert!(count == images && (row as usize) < height(0), "{kernel:?} {colour} {row}: {count} {plan:?}");
        }
    }
}

#[test]
fn what_no_device_can_run_is_refused() {
    let size = Size { width: 90, height: 70 };
    let bp = plan(size, Algorithm::Bp, Schedule::Sync, Profile::Thesis);
    let refusal = |plan: &Plan, limits: Limits| Program::new(plan, &limits).unwrap_err().to_string();
    let error = refusal(&bp, Limits { bindings: 8, ..roomy() });
    assert!(error.starts_with("a device cannot run this plan: a kernel needs 10 buffers"), "{error}");
    let error = refusal(&bp, Limits { binding_bytes: 1000, ..roomy() });
    assert!(error.contains("at most 1000 bytes"), "{error}");

    let large = Size { width: 4096, height: 4096 };
    let settings = Settings { grids: 13, ..Algorithm::Cfbp.settings(large, 1, 1, Schedule::Checkerboard) };
    let sums = Plan::new(large, Model::new(Profile::Mrf, 2).unwrap(), settings).unwrap();
    let error = refusal(&sums, roomy());
    assert!(error.contains("exceed 32 bits"), "{error}");
}

#[test]
fn what_does_not_fit_is_refused_with_both_numbers() {
    let bp = plan(Size { width: 90, height: 70 }, Algorithm::Bp, Schedule::Sync, Profile::Thesis);
    let needed = Program::new(&bp, &roomy()).unwrap().bytes();
    let limits = |memory_bytes| Limits { memory_bytes: Some(memory_bytes), ..roomy() };
    assert!(Program::new(&bp, &limits(needed)).is_ok());
    let error = Program::new(&bp, &limits(needed - 1)).unwrap_err();
    assert_eq!(error, Error::OutOfMemory { what: "device buffers", needed, available: Some(needed - 1) });
}
