"""Matchers that scripts compare: any program that writes a disparity map, and OpenCV's."""
import pathlib, shlex, subprocess

from public_pairs import BP, bp

SGBM_MODES = {"3-way": "SGBM_3WAY", "5 paths": "SGBM", "8 paths": "HH"}


def sgbm(mode, labels, block):
    """OpenCV's semi-global matcher with windows of block x block pixels, and common parameters."""
    import cv2
    return cv2.StereoSGBM_create(
        minDisparity=0, numDisparities=-(-labels // 16) * 16, blockSize=block, P1=8 * block**2, P2=32 * block**2,
        disp12MaxDiff=1, preFilterCap=63, uniquenessRatio=10, speckleWindowSize=0, speckleRange=0,
        mode=getattr(cv2, f"STEREO_SGBM_MODE_{SGBM_MODES[mode]}"))


def read_pfm(path):
    """A PFM map in little-endian floats. OpenCV would multiply by its scale, which Middlebury does not mean as one."""
    import numpy
    with path.open("rb") as file:
        _, size, _ = (file.readline() for _ in range(3))
        width, height = map(int, size.split())
        return numpy.fromfile(file, "<f4").reshape(height, width)[::-1]


def greys(left, right):
    import cv2
    return [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in (left, right)]


def write_map(path, sixteenths):
    """Writes a map of OpenCV as PFM. Negative values are unanswered."""
    import numpy
    write_pfm(path, numpy.where(sixteenths < 0, numpy.inf, sixteenths / numpy.float32(16)))


def write_pfm(path, disparities):
    height, width = disparities.shape
    path.write_bytes(f"Pf\n{width} {height}\n-1.0\n".encode() + disparities[::-1].astype("<f4").tobytes())


def aligned(left, right, labels, output):
    """Both images in grey, the right one resampled by the alignment of rows that `bp match` finds."""
    import cv2, numpy
    rows = bp("match", left, right, "--labels", labels, "--no-sidecar", "--output", output)["settings"].get("rows")
    left, right = greys(left, right)
    if not (rows and rows["corrected"]):
        return left, right
    height, width = right.shape
    x, y = numpy.meshgrid(numpy.linspace(-1, 1, width), numpy.linspace(-1, 1, height))
    terms = numpy.stack([numpy.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    columns, own = numpy.meshgrid(numpy.arange(width), numpy.arange(height))
    sources = (own + terms @ rows["coefficients"]).astype(numpy.float32)
    return left, cv2.remap(right, columns.astype(numpy.float32), sources, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)


class Sgbm:
    """OpenCV's matcher in one mode, with windows of 3x3 pixels, on the images or on those with aligned rows."""

    def __init__(self, mode, is_aligned=False):
        self.mode, self.is_aligned = mode, is_aligned

    def match(self, left, right, labels, output):
        images = aligned(left, right, labels, output) if self.is_aligned else greys(left, right)
        write_map(output, sgbm(self.mode, labels, 3).compute(*images))


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
    "bp, fast": Command("bp, fast", f"{MATCH} --quality fast"),
    "bp, best": Command("bp, best", f"{MATCH} --quality best"),
    "bp, rows as they are": Command("bp, rows as they are", f"{MATCH} --align off"),
} | {f"OpenCV SGBM, {mode}": Sgbm(mode) for mode in SGBM_MODES
} | {f"OpenCV SGBM, {mode}, aligned rows": Sgbm(mode, is_aligned=True) for mode in SGBM_MODES}


def add_option(parser, usual="all of these"):
    parser.add_argument("--matcher", action="append", metavar="NAME[=COMMAND]",
                        help="a matcher; may be repeated. COMMAND has {left}, {right}, {output} (a PFM file) and {labels}. "
                             f"Without COMMAND one of: {'; '.join(KNOWN)} [{usual}]")


def chosen(options):
    """The matchers that options name: some of KNOWN, or NAME=COMMAND. All of KNOWN, if there are no options."""
    matchers = {}
    for words in options or KNOWN:
        name, is_command, line = words.partition("=")
        if not is_command and name not in KNOWN:
            raise SystemExit(f"--matcher {name}: not NAME=COMMAND, nor one of: {'; '.join(KNOWN)}")
        matchers[name] = Command(name, line) if is_command else KNOWN[name]
    return matchers
