"""Matchers that scripts compare: any program that writes a disparity map, and OpenCV's."""
import pathlib, shlex, subprocess

from public_pairs import BP

SGBM_MODES = {"3-way": "SGBM_3WAY", "5 paths": "SGBM", "8 paths": "HH"}


def sgbm(mode, labels, block):
    """OpenCV's semi-global matcher with windows of block x block pixels, and common parameters."""
    import cv2
    return cv2.StereoSGBM_create(
        minDisparity=0, numDisparities=-(-labels // 16) * 16, blockSize=block, P1=8 * block**2, P2=32 * block**2,
        disp12MaxDiff=1, preFilterCap=63, uniquenessRatio=10, speckleWindowSize=0, speckleRange=0,
        mode=getattr(cv2, f"STEREO_SGBM_MODE_{SGBM_MODES[mode]}"))


def greys(left, right):
    import cv2
    return [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in (left, right)]


def write_map(path, sixteenths):
    """Writes a map of OpenCV as PFM. Negative values are unanswered."""
    import numpy
    disparities = numpy.where(sixteenths < 0, numpy.inf, sixteenths / numpy.float32(16)).astype("<f4")
    height, width = disparities.shape
    path.write_bytes(f"Pf\n{width} {height}\n-1.0\n".encode() + disparities[::-1].tobytes())


class Sgbm:
    """OpenCV's matcher in one mode, with windows of 3x3 pixels."""

    def __init__(self, mode):
        self.mode = mode

    def match(self, left, right, labels, output):
        write_map(output, sgbm(self.mode, labels, 3).compute(*greys(left, right)))


class Command:
    """A program. Its command line holds {left}, {right} and {output}, and may hold {labels}."""

    def __init__(self, name, line):
        self.words = shlex.split(line)
        missing = [word for word in ("{left}", "{right}", "{output}") if word not in line]
        if missing:
            raise SystemExit(f"--matcher {name}: the command lacks {' and '.join(missing)}")

    def match(self, left, right, labels, output):
        given = {"{left}": left, "{right}": right, "{output}": output, "{labels}": labels}
        words = self.words
        for name, value in given.items():
            words = [word.replace(name, str(value)) for word in words]
        try:
            subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
        except (OSError, subprocess.CalledProcessError) as error:
            raise SystemExit(f"{shlex.join(words)}: {error}")
        if not pathlib.Path(output).exists():
            raise SystemExit(f"{shlex.join(words)}: there is no {output} afterwards")


MATCH = f"{BP} match {{left}} {{right}} --output {{output}} --labels {{labels}} --no-sidecar --quiet"
KNOWN = {
    "bp": Command("bp", MATCH),
    "bp, checked": Command("bp, checked", f"{MATCH} --check left-right --median 3"),
} | {f"OpenCV SGBM, {mode}": Sgbm(mode) for mode in SGBM_MODES}


def add_option(parser):
    parser.add_argument("--matcher", action="append", metavar="NAME[=COMMAND]",
                        help="a matcher; may be repeated. COMMAND has {left}, {right}, {output} (a PFM file) and {labels}. "
                             f"Without COMMAND one of: {'; '.join(KNOWN)} [all of these]")


def chosen(options):
    """The matchers that options name: some of KNOWN, or NAME=COMMAND. All of KNOWN, if there are no options."""
    matchers = {}
    for words in options or KNOWN:
        name, is_command, line = words.partition("=")
        if not is_command and name not in KNOWN:
            raise SystemExit(f"--matcher {name}: not NAME=COMMAND, nor one of: {'; '.join(KNOWN)}")
        matchers[name] = Command(name, line) if is_command else KNOWN[name]
    return matchers
