"""Shared code of the scripts that run `bp`: the program, the public pairs, runs, errors, tables."""
import argparse, datetime, importlib.util, json, os, pathlib, platform, statistics, subprocess, sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()
BP = TARGET / "release" / "bp"
VENV = TARGET / "opencv-venv"
BESIDE = ROOT.parent / "shared" / "data"
DATA = pathlib.Path(os.environ.get("BP_DATA") or (BESIDE if BESIDE.is_dir() else "data"))
# Matches of a round that warm up, and timed ones. A process begins with cold memory, and after a pause this system may run both
# threads on one core for some 50 ms: the first three or four matches by `bp` take up to twice as long.
WARM_UP, TIMED = 5, 3

# Pair: labels, folder, and files: left, right, truth, and the option and file that define the non-occluded pixels.
OLD, NEW = "middlebury2001-2003", "middlebury2006"
OLD_FILES = ("imL.png", "imR.png", "groundtruth.png", "--mask", "nonocc.png")
NEW_FILES = ("view1.png", "view5.png", "disp1.png", "--ground-truth-right", "disp5.png")
OLD_PAIRS = {"tsukuba": (16, f"{OLD}/tsukuba", OLD_FILES), "cones": (64, f"{OLD}/cones", OLD_FILES)}
# The thesis's six pairs, at half size and at third size.
NAMES = ("Baby1", "Aloe", "Cloth1", "Flowerpots", "Bowling2", "Books")
SIX = {name: (112, f"{NEW}/{name}", NEW_FILES) for name in NAMES}
THIRDS = {name: (80, f"{NEW}-thirdsize/{name}", NEW_FILES) for name in NAMES}
# Kept apart when settings are chosen on the six.
UNTUNED = {name: (112, f"{NEW}/{name}", NEW_FILES) for name in ("Baby2", "Bowling1", "Cloth3")}
FULL = {"Books, full size": (240, f"{NEW}-fullsize/Books", NEW_FILES)}


def parser(description, has_data=True):
    made = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    if has_data:
        made.add_argument("--data", default=DATA, type=pathlib.Path, help="data folder [BP_DATA, else %(default)s]")
    made.add_argument("--output", metavar="FILE.json", type=pathlib.Path, help="also write everything as JSON")
    return made


def add_record_options(parser):
    """Options of scripts that can also print what an earlier run measured."""
    parser.add_argument("--from", dest="record", metavar="FILE.json", type=pathlib.Path,
                        help="measure nothing; read a file that --output wrote")
    parser.add_argument("--readme", metavar="README.md", type=pathlib.Path,
                        help="with --from: write the summary between this file's markers")
    parser.add_argument("--check", action="store_true", help="with --readme: write nothing, fail if it would differ")


def renew(arguments, name, part):
    """Writes a part of a page between the markers of that name; with --check, only fails if it would differ."""
    readme, begin, end = arguments.readme, f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"
    text = readme.read_text()
    before, found, rest = text.partition(begin)
    _, ended, after = rest.partition(end)
    if not (found and ended):
        raise SystemExit(f"{readme}: the markers {begin.strip()} and {end} are missing")
    renewed = before + begin + part + end + after
    if arguments.check and renewed != text:
        raise SystemExit(f"{readme} differs from its record; run: {' '.join(sys.argv).replace(' --check', '')}")
    if not arguments.check:
        readme.write_text(renewed)


def enter_venv(folder, *more):
    """Restarts the script in the virtual environment, and creates that if it is missing. Installs OpenCV and `more`."""
    python = folder / "bin" / "python"
    if pathlib.Path(sys.prefix).resolve() != folder.resolve():
        if not python.exists():
            subprocess.run([sys.executable, "-m", "venv", folder], check=True)
        os.execv(python, [python, *sys.argv])
    packages = {"cv2": "opencv-python-headless", "numpy": "numpy"} | {name: {"PIL": "pillow"}.get(name, name) for name in more}
    missing = [package for module, package in packages.items() if not importlib.util.find_spec(module)]
    if missing:
        versions = ROOT / "scripts" / "python-versions.txt"
        subprocess.run([python, "-m", "pip", "install", "--quiet", "--constraint", versions, *missing], check=True)


def build():
    subprocess.run(["cargo", "build", "--quiet", "--release", "--locked", "--bin", "bp"], cwd=ROOT, check=True)


def bp(*words):
    return json.loads(subprocess.run([BP, *map(str, words), "--json"], check=True, stdout=subprocess.PIPE).stdout)


class Pair:
    def __init__(self, name, files, data):
        self.name = name
        self.labels, folder, (left, right, truth, option, visible) = files
        self.images = [data / folder / left, data / folder / right]
        manifest = json.loads((ROOT / "crates" / "harness" / "data" / "middlebury.json").read_text())["files"]
        scale = next(file["scale"] for file in manifest if file["path"] == f"{folder}/{truth}")
        self.truth = [data / folder / truth, "--scale", scale, option, data / folder / visible]
        missing = [path for path in (*self.images, data / folder / truth) if not path.exists()]
        if missing:
            raise SystemExit(f"--data {data}: {missing[0]} is missing; see scripts/fetch-middlebury")

    def errors(self, path, *options):
        report = bp("evaluate", path, *self.truth, *options)
        half, one = map(report["thresholds_px"].index, (0.5, 1))
        figures = {}
        for region in ("all", "visible"):
            errors = report[region]
            figures |= {f"bad_{region}": errors["bad_or_unanswered"][one], f"rmse_{region}": errors["rmse"],
                        f"bad_half_{region}": errors["bad_or_unanswered"][half]}
        return figures | {"answered": 100 * report["all"]["answered"] / report["all"]["known"]}


class BeliefPropagation:
    """`bp match` with some options."""

    def __init__(self, pair, options, output):
        self.pair, self.output = pair, output
        self.command = ["match", *pair.images, "--output", output, "--labels", pair.labels, "--no-sidecar",
                        *options.split()]

    def times(self, threads):
        return bp(*self.command, "--repeat", WARM_UP + TIMED, "--threads", threads)["samples_ms"][WARM_UP:]

    def errors(self, _):
        return {"filled": self.pair.errors(self.output)}


def about():
    """The machine and the versions."""
    lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines() if os.path.exists("/proc/cpuinfo") else []
    cpu = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor())
    git = ["git", "-C", ROOT, "describe", "--always", "--dirty", "--abbrev=12"]
    commit = subprocess.run(git, stdout=subprocess.PIPE, text=True).stdout.strip()
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    machine = {"cpu": cpu, "cores": cores, "system": platform.platform()}
    return {"date": datetime.date.today().isoformat(), "machine": machine, "versions": {"bp": commit or "unknown"}}


def median_and_range(values, digits=1):
    return f"{statistics.median(values):.{digits}f} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def markdown(heads, rows):
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [heads, ["---"] * len(heads), *rows])


def write(path, report):
    if path:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(report, indent=1) + "\n")
