//! Translates the arguments of `bp match` for frames that come through pipes.

use bp_io::FrameFormat;
use bp_stereo::stream::{StreamOptions, StreamSource};

use super::{ManyArgs, MatchArgs, OutputArgs};
use crate::failure::Failure;

impl MatchArgs {
    /// The video that comes through pipes, and the format of its maps; `None` if the arguments ask for something else.
    pub(crate) fn stream(&self) -> Result<Option<(StreamOptions, FrameFormat)>, Failure> {
        let Some(source) = self.many.stream()? else { return Ok(None) };
        self.check_stream()?;
        let making = self.making()?;
        let format = match self.many.format() {
            "pfm" => FrameFormat::Pfm,
            "npy" => FrameFormat::Npy { nan: making.nan },
            "y4m" => FrameFormat::Y4m(making.picture.colours),
            other => {
                let known = FrameFormat::EXTENSIONS.join(", ");
                return Err(Failure::usage(format!("--format {other}: maps that follow one another are {known}")));
            }
        };
        let options = StreamOptions {
            source,
            matching: self.options()?,
            alignment: self.plan.align.file().cloned(),
            rectifying: making.rectifying,
            max_megapixels: self.max_megapixels,
        };
        Ok(Some((options, format)))
    }

    /// Refuses arguments that would do nothing.
    fn check_stream(&self) -> Result<(), Failure> {
        let (many, OutputArgs { picture, depth, points, making }) = (&self.many, &self.outputs);
        if !self.is_piped() {
            let what = "frames from pipes give maps to a pipe: --output -";
            return Err(Failure::usage(format!("{what}; for files, give patterns such as 'left/%04d.png'")));
        }
        let has_files = [picture, depth, points, &self.finish.confidence].into_iter().any(Option::is_some);
        if making.negate {
            return Err(Failure::usage("--negate is for files: the maps of frames have our sign"));
        }
        if has_files || !many.also.is_empty() || many.shard.is_some() || many.force || many.warm_start.is_some() {
            let what = "frames from pipes give maps alone, or with --format y4m their pictures";
            return Err(Failure::usage(format!("{what}: other outputs, --shard, --force and --warm-start need files")));
        }
        Ok(())
    }
}

impl ManyArgs {
    /// The pipes or files that frames come from; `None` if `--video` is not given, or has patterns.
    pub(super) fn stream(&self) -> Result<Option<StreamSource>, Failure> {
        let layout = self.layout.unwrap_or_default();
        match self.video.as_deref() {
            Some([joined]) => Ok(Some(StreamSource::Joined(joined.into(), layout))),
            Some([left, right]) if is_stream(left) && is_stream(right) => match (&**left, &**right, self.layout) {
                ("-", "-", _) => {
                    Err(Failure::usage("--video - -: standard input is one stream; give - once if it has both images"))
                }
                (.., Some(_)) => Err(Failure::usage("--layout is for frames that hold both images")),
                _ => Ok(Some(StreamSource::Separate([left.into(), right.into()]))),
            },
            Some(_) if self.layout.is_some() => Err(Failure::usage("--layout is for frames that hold both images")),
            _ => Ok(None),
        }
    }
}

/// Whether this is a stream of frames, not a pattern.
fn is_stream(name: &str) -> bool {
    !name.contains(['%', '*'])
}
