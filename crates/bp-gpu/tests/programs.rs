//! Programs stay within any limits of a device, and leave no node out.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::collections::HashMap;

use bp_core::{Algorithm, Error, Model, Plan, Profile, Schedule, Settings, Size};
use bp_gpu::{Access, Command, Kernel, Limits, Parameters, Program, Shape};

fn plan(size: Size, algorithm: Algorithm, schedule: Schedule, profile: Profile) -> Plan {
    let model = Model::new(profile, 30).unwrap();
    let model = if profile == Profile::Census { model.with_edges_halved_above(10) } else { model };
    Plan::new(size, model, algorithm.settings(size, 20, 2, schedule)).unwrap()
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
    let tight = tight();
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
            let entries = match kernel {
                // A workgroup has a segment of a band.
                Kernel::PassRows | Kernel::DecideRows => workgroups * parameters.span * 20,
                // An invocation of refine writes one message at eight nodes, one of update_messages writes four at four.
                Kernel::Refine => parameters.rows * parameters.words.div_ceil(2),
                _ => parameters.rows * parameters.words,
            } * 16
                * parameters.labels;
            let single = parameters.rows == 1 || (kernel.has_segments() && workgroups == 1);
            assert!(u64::from(entries) <= tight.dispatch_entries || single, "{kernel:?} {plan:?}");
            cut += u32::from(parameters.first_row > 0);
        }
    }
    assert!(cut > 0, "no grid was cut into strips");
}

/// Limits that cut a plan up, and the other shape.
fn tight() -> Limits {
    let shape = Shape::Slices;
    Limits { binding_bytes: 600_000, workgroups: 7, dispatch_entries: 1 << 16, shape, ..Limits::roomy() }
}

/// The rows of a dispatch, counted from the first one of its strip.
fn rows(kernel: Kernel, p: &Parameters) -> impl Iterator<Item = u32> {
    let (span, bands) = (p.span.max(1), if kernel.has_segments() { p.rows } else { p.rows / p.span.max(1) });
    let (row, step) = (p.row, p.row_step);
    (0..bands).flat_map(move |band| (0..span).map(move |i| row + band * step + i))
}

/// How often a program's kernels compute each row of each colour.
fn computed(program: &Program) -> HashMap<(Kernel, u32, u32, u32), u32> {
    let mut times = HashMap::new();
    // The dispatches of several segments of a row begin with the same ones.
    for Dispatch { kernel, parameters: p, .. } in
        dispatches(program).filter(|found| found.parameters.first_segment == 0)
    {
        for row in rows(kernel, &p).filter(|&row| row < p.strip_rows || kernel == Kernel::Features) {
            *times.entry((kernel, p.width, p.first_row + row, p.colour)).or_default() += 1;
        }
    }
    times
}

/// How often a kernel should compute a row of an image of this height in a program with one grid. `features` does not
/// distinguish colours.
fn expected(kernel: Kernel, schedule: Schedule, height: u32, (row, colour): (u32, u32)) -> u32 {
    match (kernel, schedule) {
        (Kernel::Features, _) => 2,
        (Kernel::Greys | Kernel::EdgeCosts | Kernel::MatchCost, _) => 1,
        (Kernel::PassRows, _) => passes(height, row, colour),
        (Kernel::SelectLabels | Kernel::DecideRows, Schedule::Sweep) => {
            1 + u32::from(has_seam_below(height, row) && row % 32 >= 26)
        }
        (Kernel::SelectLabels, _) => 1,
        (Kernel::DecideRows, _) => 0,
        // A program contains two steps.
        (Kernel::UpdateMessages | Kernel::UpdateMessagesOfSlice, Schedule::Sync) => 2,
        (Kernel::UpdateMessages | Kernel::UpdateMessagesOfSlice, Schedule::Checkerboard) => 1,
        (Kernel::UpdateMessages | Kernel::UpdateMessagesOfSlice, Schedule::Outward { .. }) => 0,
        (Kernel::UpdateMessages | Kernel::UpdateMessagesOfSlice, Schedule::Sweep) => sweeps(height, row, colour),
        (Kernel::Refine, Schedule::Sweep) => restored(height, row, colour),
        (Kernel::CoarsenGreys | Kernel::Coarsen | Kernel::Refine, _) => 0,
        (Kernel::LabelSets | Kernel::RestrictCosts | Kernel::ExtendMessages | Kernel::Copy, _) => 0,
    }
}

/// The sides to which first messages are written again after the seams have been prepared, since a backward pass overwrote
/// them: odd nodes send left, right and up, even ones up. What the row below a seam sends up stays.
fn restored(height: u32, row: u32, colour: u32) -> u32 {
    let in_band = row % 32;
    let above = has_seam_below(height, row) && in_band >= 26;
    let below = row >= 32 && in_band < 4;
    let up = u32::from(above || (below && in_band > 0));
    up + 2 * colour * u32::from(above || below)
}

fn has_seam_below(height: u32, row: u32) -> bool {
    (row / 32 + 1) * 32 < height
}

/// How often a pass goes through a row with this colour in the lead: once in a loop, and where a seam is prepared, forward through
/// twelve rows above it and four below, backward through those four and six above.
fn passes(height: u32, row: u32, colour: u32) -> u32 {
    let in_band = row % 32;
    let above = has_seam_below(height, row) && in_band >= if colour == 0 { 20 } else { 26 };
    let below = row >= 32 && in_band < 4;
    1 + u32::from(above || below)
}

/// How often the nodes of a colour send in a row under `sweep`.
fn sweeps(height: u32, row: u32, colour: u32) -> u32 {
    let in_band = row % 32;
    // Forward and backward, except odd nodes in a band's last row and even nodes in its first.
    let in_loop = if (in_band, colour) == (31, 1) || (in_band, colour) == (0, 0) { 1 } else { 2 };
    // To prepare a seam: forward over twelve rows above it, and backward over the lower six of them.
    let above = if has_seam_below(height, row) { u32::from(in_band >= 20) + u32::from(in_band >= 26) } else { 0 };
    // Forward and backward over four rows below it, except odd nodes forward in the last of them.
    let below = if row >= 32 && in_band < 4 { 2 - u32::from((in_band, colour) == (3, 1)) } else { 0 };
    in_loop + above + below
}

#[test]
fn every_row_is_computed_as_often_as_it_should_be() {
    let tight = tight();
    for (plan, limits) in plans().flat_map(|plan| [(plan.clone(), Limits::roomy()), (plan, tight.clone())]) {
        let rows = computed(&Program::new(&plan, &limits).unwrap());
        let (size, height) = (plan.image_size(), |grid: usize| plan.size(grid).height);
        let sum = |wanted| rows.iter().filter(|((kernel, ..), _)| *kernel == wanted).map(|(_, &n)| n as usize).sum();
        let coarse: usize = (1..plan.grids()).map(height).sum();
        assert_eq!(2 * coarse, sum(Kernel::Coarsen), "{plan:?}");
        let uniform = plan.model().edges().is_uniform();
        let greys = if uniform { [0, 0] } else { [2 * size.height, 2 * coarse] };
        assert_eq!([sum(Kernel::Greys), sum(Kernel::CoarsenGreys)], greys, "{plan:?}");
        if plan.settings().schedule != Schedule::Sweep {
            let fine: usize = (0..plan.grids() - 1).map(height).sum();
            assert_eq!(4 * 2 * fine, sum(Kernel::Refine), "{plan:?}");
        }
        // The coarsest grids may have the same width, so that their rows are counted together.
        for (&(kernel, _, row, colour), &count) in rows.iter().filter(|_| plan.grids() == 1) {
            let expected = expected(kernel, plan.settings().schedule, size.height as u32, (row, colour));
            assert!((row as usize) < size.height, "{kernel:?} {plan:?}");
            assert_eq!(count, expected, "{kernel:?}, row {row}, colour {colour}: {plan:?}");
        }
    }
}

/// Sets and costs are made for the rows around seams, then for all bands. Messages get values for all labels where they cross
/// a seam, and on grid 1 where the finer grid starts with them: those up, and those of odd nodes to the sides.
#[test]
fn label_sets_are_made_twice_a_grid_and_only_on_the_two_finest() {
    let size = Size { width: 150, height: 131 };
    let settings = Settings { label_sets: true, ..Algorithm::Sweep.settings(size, 1, 1, Schedule::Sweep) };
    let plan = Plan::new(size, Model::new(Profile::Census, 40).unwrap(), settings).unwrap();
    let rows = computed(&Program::new(&plan, &Limits::roomy()).unwrap());
    for (grid, size) in (0..plan.grids()).map(|grid| (grid, plan.size(grid))) {
        let (width, height) = (size.width as u32, size.height as u32);
        let count = |kernel, row, colour| rows.get(&(kernel, width, row, colour)).copied().unwrap_or(0);
        let has_sets = u32::from(grid < 2);
        for window in 0..height.div_ceil(32) {
            let sets = count(Kernel::LabelSets, window, 0);
            assert_eq!(sets, has_sets * (1 + u32::from(has_seam_below(height, 32 * window))), "{grid} {window}");
        }
        for (row, colour) in (0..height).flat_map(|row| [(row, 0), (row, 1)]) {
            let [above, below] = [has_seam_below(height, row) && row % 32 >= 20, row >= 32 && row % 32 < 4];
            let restricted = has_sets * (1 + u32::from(above || below));
            assert_eq!(count(Kernel::RestrictCosts, row, colour), restricted, "{grid} {row}");
            let across =
                u32::from(has_seam_below(height, row) && row % 32 == 31) + u32::from(row >= 32 && row % 32 == 0);
            let started = if grid == 1 { 1 + 2 * colour } else { 0 };
            assert_eq!(count(Kernel::ExtendMessages, row, colour), has_sets * across + started, "{grid} {row}");
        }
    }
}

#[test]
fn what_no_device_can_run_is_refused() {
    let size = Size { width: 90, height: 70 };
    let bp = plan(size, Algorithm::Bp, Schedule::Sync, Profile::Thesis);
    let refusal = |plan: &Plan, limits: Limits| Program::new(plan, &limits).unwrap_err().to_string();
    let error = refusal(&bp, Limits { bindings: 8, ..Limits::roomy() });
    assert!(error.starts_with("a device cannot run this plan: a kernel needs 12 buffers"), "{error}");
    let error = refusal(&bp, Limits { workgroups: 1, ..Limits::roomy() });
    assert!(error.contains("a row has 90 pixels and it computes at most 64"), "{error}");
    let error = refusal(&bp, Limits { invocations: 128, shape: Shape::Slices, ..Limits::roomy() });
    assert!(error.ends_with("a workgroup needs 256 invocations and it allows 128: set BP_GPU_SHAPE=words"), "{error}");
    let error = refusal(&bp, Limits { binding_bytes: 1000, ..Limits::roomy() });
    assert!(error.contains("at most 1000 bytes"), "{error}");

    let large = Size { width: 4096, height: 4096 };
    let settings = Settings { grids: 13, ..Algorithm::Cfbp.settings(large, 1, 1, Schedule::Checkerboard) };
    let sums = Plan::new(large, Model::new(Profile::Mrf, 2).unwrap(), settings).unwrap();
    let error = refusal(&sums, Limits::roomy());
    assert!(error.contains("exceed 32 bits"), "{error}");
}

#[test]
fn what_does_not_fit_is_refused_with_both_numbers() {
    let bp = plan(Size { width: 90, height: 70 }, Algorithm::Bp, Schedule::Sync, Profile::Thesis);
    let needed = Program::new(&bp, &Limits::roomy()).unwrap().bytes();
    let limits = |memory_bytes| Limits { memory_bytes: Some(memory_bytes), ..Limits::roomy() };
    assert!(Program::new(&bp, &limits(needed)).is_ok());
    let error = Program::new(&bp, &limits(needed - 1)).unwrap_err();
    assert_eq!(error, Error::OutOfMemory { what: "device buffers", needed, available: Some(needed - 1) });
}

/// How a command uses a buffer: (buffer, whether it is written, kernel if any, colour and first row).
type Use = (usize, bool, Option<Kernel>, (u32, u32));

/// Used as colour and first row of a copy.
const COPIED: (u32, u32) = (u32::MAX, 0);

fn uses(program: &Program, command: &Command) -> Vec<Use> {
    match *command {
        Command::Dispatch { bind_group, parameters, .. } => {
            let block = &program.parameters[parameters as usize..][..size_of::<Parameters>()];
            let p: Parameters = bytemuck::pod_read_unaligned(block);
            let group = &program.bind_groups[bind_group];
            let bound = group.buffers.iter().zip(group.kernel.bindings());
            bound
                .map(|(&buffer, &access)| (buffer, access == Access::Write, Some(group.kernel), (p.colour, p.row)))
                .collect()
        }
        Command::Copy { from, to, .. } => vec![(from, false, None, COPIED), (to, true, None, COPIED)],
        Command::Clear { buffer } => vec![(buffer, true, None, (0, 0))],
        Command::Barrier => Vec::new(),
    }
}

/// Whether two commands without a barrier between them may use the same buffer. They may not if one writes what the
/// other reads or writes. Dispatches of one kernel write different rows. All colours and strips share the labels; under
/// `sweep` a dispatch reads those of the other colour. Copies between strips read and write different rows.
fn may_meet(program: &Program, sweep: bool, a: Use, b: Use) -> bool {
    let is_read_only = !a.1 && !b.1;
    let other_rows = a.1 && b.1 && a.2.is_some() && a.2 == b.2 && a.3 != b.3;
    let labels = program.buffers[a.0].name == "labels" && a.2.is_some() && b.2.is_some();
    let unused = program.buffers[a.0].name == "unused";
    let copies = (a.3, b.3) == (COPIED, COPIED);
    let decided_one_after_another = labels && sweep && a.3.0 != b.3.0;
    is_read_only || copies || unused || (!decided_one_after_another && (other_rows || labels))
}

/// Looks for missing barriers. Other tests cannot: on lavapipe dispatches never overlap, and validation layers check
/// only copies.
#[test]
fn commands_without_a_barrier_between_them_do_not_meet() {
    let tight = tight();
    for (plan, limits) in plans().flat_map(|plan| [(plan.clone(), Limits::roomy()), (plan, tight.clone())]) {
        let program = Program::new(&plan, &limits).unwrap();
        let sweep = plan.settings().schedule == Schedule::Sweep;
        for segment in &program.segments {
            for run in segment.commands.split(|command| *command == Command::Barrier) {
                let mut used: HashMap<usize, Vec<Use>> = HashMap::new();
                for (command, a) in
                    run.iter().flat_map(|command| uses(&program, command).into_iter().map(move |a| (command, a)))
                {
                    let before = used.entry(a.0).or_default();
                    let meets = before.iter().find(|&&b| !may_meet(&program, sweep, a, b));
                    assert!(meets.is_none(), "{command:?} in {:?}: {plan:?}", program.buffers[a.0].name);
                    before.push(a);
                }
            }
        }
    }
}
