//! Translates the arguments of `bp match` and `bp convert` into the library's options. All checks of arguments against
//! each other are here.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use bp_core::{Algorithm as Kind, MessageStart, Schedule};
use bp_io::{Files, Geometry, Picture};
use bp_stereo::{
    Algorithm, Hierarchy, Loops, Making, Options, Outputs, Quality, Rectifying,
    batch::{Also, BatchOptions},
    pairs::Source,
};

use super::{Check, ManyArgs, MatchArgs, OutputArgs, PlanArgs};
use crate::{colour_bar, failure::Failure, interrupt};

/// The algorithms that count loops as the thesis does, for messages.
const THESIS: &str = "--algorithm bp, cfbp, cfcsbp, ctbp or ctcsbp";

impl MatchArgs {
    /// The library's options for each pair.
    pub(crate) fn options(&self) -> Result<Options, Failure> {
        let (plan, finish) = (&self.plan, &self.finish);
        check_finish(self)?;
        let checks = |by| finish.check.map(|check| check == by);
        let options = Options {
            algorithm: plan.meaning()?,
            quality: plan.quality,
            profile: plan.profile,
            slope: plan.slope,
            truncation: plan.truncation,
            edge_threshold: plan.edge_threshold,
            stretch: self.stretch,
            align: plan.align.meaning()?,
            labels: plan.labels.unwrap_or_default(),
            min_disparity: plan.min_disparity,
            check: checks(Check::LeftRight),
            unique: checks(Check::Unique),
            speckle: finish.speckle.map(|least| least as usize),
            fill: finish.fill.unwrap_or(true),
            median: finish.median,
            subpixel: finish.whole_pixels.then_some(false),
            confidence: finish.confidence.is_some() || self.many.also.contains(&Also::Confidence),
            energy: false,
            backend: plan.backend.clone(),
            device: plan.device.clone(),
            threads: plan.threads.map(usize::from),
            max_memory: self.max_memory.map(|limit| limit.as_u64()),
        };
        options.check()?;
        Ok(options)
    }

    /// The output files of one pair.
    pub(crate) fn outputs(&self) -> Outputs {
        let map = Some(self.output.as_path()).filter(|_| !self.is_piped());
        Outputs { confidence: self.finish.confidence.clone(), ..self.outputs.outputs(map) }
    }

    /// Whether the map goes to standard output.
    pub(crate) fn is_piped(&self) -> bool {
        self.output == Path::new("-")
    }

    /// The batch that the arguments ask for; `None` for one pair.
    pub(crate) fn batch(&self) -> Result<Option<BatchOptions>, Failure> {
        let Some(source) = self.many.source() else { return Ok(None) };
        let OutputArgs { picture, depth, points, .. } = &self.outputs;
        if [picture, depth, points, &self.finish.confidence].into_iter().any(Option::is_some) {
            let what = "--picture, --depth, --points and --confidence name one file";
            return Err(Failure::usage(format!("{what}: for many pairs use --also picture,depth,points,confidence")));
        }
        Ok(Some(BatchOptions {
            source,
            output: self.output.clone(),
            alignment: self.plan.align.file().cloned(),
            matching: self.options()?,
            format: self.many.format().to_owned(),
            also: self.many.also.clone(),
            shard: self.many.shard.unwrap_or_default(),
            warm_start: self.many.warm_start,
            force: self.many.force,
            max_megapixels: self.max_megapixels,
        }))
    }

    /// How files are made.
    pub(crate) fn making(&self) -> Result<Making, Failure> {
        let also = |what| self.many.also.contains(&what);
        let (has_depth, is_coloured) = (also(Also::Depth) || also(Also::Points), self.many.format() == "y4m");
        self.outputs.making(also(Also::Picture) || is_coloured, has_depth, self.rectify)
    }
}

fn check_finish(args: &MatchArgs) -> Result<(), Failure> {
    let is_batch = args.many.stream()?.is_none() && (args.many.pairs.is_some() || args.many.video.is_some());
    if args.is_piped() && (args.json || is_batch) {
        return Err(Failure::usage(
            "--output - writes maps to standard output, without --json, --pairs or patterns of --video",
        ));
    }
    let finish = &args.finish;
    let checks = finish.check.map_or(args.plan.quality != Quality::Fast, |check| check != Check::Off);
    if finish.fill.is_some() && !checks && finish.speckle.is_none() {
        return Err(Failure::usage("--fill needs --check or --speckle, which leave something to fill"));
    }
    let truth = &args.truth;
    let reads_truth = truth.ground_truth_right.is_some() || truth.mask.is_some() || truth.scale.is_some();
    if args.ground_truth.is_none() && reads_truth {
        return Err(Failure::usage("--ground-truth-right, --mask and --scale need --ground-truth"));
    }
    args.many.check()
}

impl ManyArgs {
    /// The source of many pairs; `None` for one pair.
    fn source(&self) -> Option<Source> {
        match (&self.pairs, self.video.as_deref()) {
            (Some(path), _) if path == Path::new("-") => Some(Source::StandardInput),
            (Some(path), _) => Some(Source::Path(path.clone())),
            (None, Some([left, right])) => Some(Source::Video([left.clone(), right.clone()])),
            (None, _) => None,
        }
    }
}

impl OutputArgs {
    /// The output files of a map.
    pub(crate) fn outputs(&self, map: Option<&Path>) -> Outputs {
        let Self { picture, depth, points, .. } = self.clone();
        Outputs { map: map.map(Into::into), picture, depth, points, confidence: None }
    }

    /// How files are made. `also_picture` and `also_depth` say whether other arguments ask for a picture, or for depth
    /// or points, and `rectify` whether the images are raw.
    pub(crate) fn making(&self, also_picture: bool, also_depth: bool, rectify: bool) -> Result<Making, Failure> {
        let args = &self.making;
        if self.picture.is_none() && !also_picture && (args.colours.is_some() || args.no_colour_bar) {
            let what = "--colours and --no-colour-bar are for a picture";
            return Err(Failure::usage(format!("{what}: give --picture too (for many pairs, --also picture)")));
        }
        let has_depth = self.depth.is_some() || self.points.is_some() || also_depth;
        let has_calib = !args.calib.is_empty();
        if !has_depth && !rectify && (has_calib || args.focal.is_some()) {
            let what = "--calib and --focal are for depth and points";
            return Err(Failure::usage(format!(
                "{what}: give --depth or --points too (for many pairs, --also depth,points)"
            )));
        }
        let given = args.focal.zip(args.baseline).map(|(focal, baseline)| Geometry {
            focal,
            baseline,
            doffs: args.doffs.unwrap_or(0.0),
            principal_point: args.principal_point,
            file: None,
        });
        let read = (has_calib && !rectify).then(|| Geometry::read(&args.calib)).transpose()?;
        let rectifying = rectify.then(|| Rectifying::read(&args.calib)).transpose()?;
        let bar = (!args.no_colour_bar).then_some(colour_bar::draw as bp_io::DrawBar);
        let picture = Picture { colours: args.colours.unwrap_or_default(), bar };
        Ok(Making {
            picture,
            no_sidecar: args.no_sidecar,
            nan: args.unknown == Some(true),
            negate: args.negate,
            geometry: read.or(given),
            rectifying: rectifying.map(Arc::new),
            files: Files::default().stopping(interrupt::is_stopped),
        })
    }

    /// The calibration's files.
    pub(crate) fn calibration(&self) -> &[PathBuf] {
        &self.making.calib
    }
}

impl PlanArgs {
    fn kind(&self) -> Kind {
        self.algorithm.unwrap_or(Kind::Sweep)
    }

    /// The algorithm with its options.
    fn meaning(&self) -> Result<Algorithm, Failure> {
        self.check()?;
        self.check_algorithm()?;
        let (loops, hierarchy, z) = (self.counted(), self.hierarchy(), self.z);
        let seed_start = self.seed_start.unwrap_or(true);
        Ok(match self.kind() {
            Kind::Sweep => Algorithm::Sweep {
                grids: self.grids.map(u32::from),
                loops: self.loops.unwrap_or(1),
                coarse_clip: self.coarse_clip.unwrap_or(true),
                label_sets: self.label_sets,
            },
            Kind::Bp => Algorithm::Bp { loops },
            Kind::Cfbp => Algorithm::Cfbp { loops, hierarchy },
            Kind::Cfcsbp => Algorithm::Cfcsbp { loops, hierarchy, z },
            Kind::Ctbp => Algorithm::Ctbp { loops, seed_start },
            Kind::Ctcsbp => Algorithm::Ctcsbp { loops, seed_start, z },
        })
    }

    /// How loops are counted.
    fn counted(&self) -> Loops {
        let schedule = self.schedule.unwrap_or(Schedule::Sync);
        match (self.half_steps, self.grids, self.loops) {
            (Some(half_steps), ..) => Loops::HalfSteps(half_steps),
            (None, Some(_), Some(loops)) => Loops::OnEachGrid { loops, schedule },
            (None, _, k) => Loops::Total { k, schedule },
        }
    }

    fn hierarchy(&self) -> Hierarchy {
        Hierarchy {
            grids: self.grids.map(u32::from),
            message_start: self.message_start.unwrap_or(MessageStart::Receiver),
            coarse_clip: self.coarse_clip.unwrap_or(false),
            label_sets: self.label_sets.unwrap_or(false),
        }
    }

    /// Refuses arguments that contradict each other or would do nothing.
    fn check(&self) -> Result<(), Failure> {
        let is_swept = self.kind() == Kind::Sweep;
        let on_each_grid = self.grids.is_some() || self.half_steps.is_some() || is_swept;
        if self.z.is_some() && self.kind().divides_loops() && on_each_grid {
            let what = "--z divides the total loops, but --grids and --half-steps set the loops on each grid";
            return Err(Failure::usage(what));
        }
        let is_counted = self.loops.is_some() || self.half_steps.is_some() || is_swept;
        if self.grids.is_some() && self.kind().is_coarse_to_fine() && !is_counted {
            return Err(Failure::usage("--grids needs --loops or --half-steps, which then count on each grid"));
        }
        if self.half_steps.is_some() && self.schedule.is_some_and(|schedule| schedule != Schedule::Checkerboard) {
            return Err(Failure::usage("--half-steps needs --schedule checkerboard"));
        }
        Ok(())
    }

    /// Refuses arguments of other algorithms.
    fn check_algorithm(&self) -> Result<(), Failure> {
        let kind = self.kind();
        let needs = |given: bool, holds: bool, option: &str, what: &str| {
            let refused = || Failure::usage(format!("{option} needs {what}, not {}", kind.name()));
            if given && !holds { Err(refused()) } else { Ok(()) }
        };
        let (coarse_to_fine, is_swept) = (kind.is_coarse_to_fine(), kind == Kind::Sweep);
        needs(self.grids.is_some(), coarse_to_fine, "--grids", "--algorithm cfbp, cfcsbp or sweep")?;
        needs(self.label_sets.is_some(), coarse_to_fine, "--label-sets", "--algorithm cfbp, cfcsbp or sweep")?;
        if self.label_sets == Some(true) && !is_swept && self.schedule != Some(Schedule::Sweep) {
            return Err(Failure::usage("--label-sets on needs --schedule sweep"));
        }
        needs(self.coarse_clip.is_some(), coarse_to_fine, "--coarse-clip", "--algorithm cfbp, cfcsbp or sweep")?;
        let has_start = coarse_to_fine && !is_swept;
        needs(self.message_start.is_some(), has_start, "--message-start", "--algorithm cfbp or cfcsbp")?;
        needs(self.half_steps.is_some(), !is_swept, "--half-steps", THESIS)?;
        let other_schedule = self.schedule.is_some_and(|schedule| schedule != Schedule::Sweep);
        needs(other_schedule, !is_swept, "--schedule sync or checkerboard", THESIS)?;
        needs(self.z.is_some(), kind.divides_loops(), "--z", "--algorithm cfcsbp or ctcsbp")?;
        needs(self.seed_start.is_some(), kind.is_cut(), "--seed-start", "--algorithm ctbp or ctcsbp")
    }
}
