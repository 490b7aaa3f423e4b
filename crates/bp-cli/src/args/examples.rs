//! The examples below the options in the help.

use crate::failure;

/// The examples of `bp` itself, and the exit codes of all commands.
pub(super) fn program() -> String {
    format!(
        "\
Examples:
  bp match left.png right.png --output map.pfm --picture map.png
  bp match --pairs dataset --output maps
  bp evaluate map.png truth.png --scale 2
  bp reproduce --quick
  bp doctor

{}

Results go to standard output, with --json as JSON only. Everything else goes to standard error. RUST_LOG=debug logs
the devices opened, the plans prepared and the pairs solved. NO_COLOR=1 turns colours off.",
        failure::exit_codes()
    )
}

pub(super) const MATCH: &str = "\
Examples:
  bp match left.png right.png --output map.pfm --picture map.png
  bp match left.png right.png --output map.pfm --labels auto
  bp match left.png right.png --output map.png --algorithm bp --profile thesis --labels 112
  bp match left.png right.png --output map.pfm --ground-truth truth.png --scale 2 --json
  bp match --pairs dataset --output maps                        # run it again to resume
  bp match --pairs list.csv --output maps --shard 2/4           # the second of four processes
  bp match --video 'left/%04d.png' 'right/%04d.png' --output maps --format png --also picture
  ffmpeg -i stereo.mp4 -f yuv4mpegpipe - | bp match --video - --output - --format y4m | ffplay -";

pub(super) const CONVERT: &str = "\
Examples:
  bp convert map.pfm --picture map.png
  bp convert map.pfm --image left.png --points cloud.ply --calib calib.txt";

pub(super) const RECTIFY: &str = "\
Examples:
  bp rectify raw-left.png raw-right.png --calib stereo.yml --output rectified
  bp match rectified/left.png rectified/right.png --calib rectified/calib.txt --depth depth.tif --output map.pfm
  bp match raw-left.png raw-right.png --calib stereo.yml --rectify --points cloud.ply --output map.pfm  # in one step";

pub(super) const EVALUATE: &str = "\
Examples:
  bp evaluate map.pfm truth.png --scale 2
  bp evaluate map.pfm truth.pfm --mask nonocc.png --json
  bp evaluate map.pfm disp0GT.pfm --mask mask0nocc.png --limit 70 --thresholds 0.125,0.25,0.5,1";

pub(super) const REPRODUCE: &str = "\
Examples:
  bp reproduce --quick
  bp reproduce --data data --backend scalar,rayon";

pub(super) const REPORT: &str = "\
Examples:
  bp report results/RUN
  bp report results/RUN --readme README.md";

pub(super) const SCENES: &str = "\
Example:
  bp scenes --data data";

pub(super) const DEVICES: &str = "\
Example:
  bp devices --json";

pub(super) const DOCTOR: &str = "\
Example:
  bp doctor --data data";

pub(super) const CONFORM: &str = "\
Example:
  bp conform --backend rayon,vulkan";

pub(super) const SPEED: &str = "\
Examples:
  bp speed --backend scalar,rayon --quick
  bp speed --backend vulkan,rayon --output speed";

pub(super) const GATE: &str = "\
Examples:
  bp gate --quick
  bp gate --quick --update                 # a new baseline for this kind of machine
  bp gate --instructions";

pub(super) const COMPARE: &str = "\
Example:
  bp compare results/RUN results/OTHER";

pub(super) const EXPORT: &str = "\
Example:
  bp export --format csv results/RUN --output run.csv";

pub(super) const COMPLETIONS: &str = "\
Examples:
  bp completions bash > ~/.local/share/bash-completion/completions/bp
  bp completions zsh > ~/.zfunc/_bp        # a folder of $fpath
  bp completions fish > ~/.config/fish/completions/bp.fish";

pub(super) const MAN: &str = "\
Example:
  bp man ~/.local/share/man/man1 && man bp-match";
