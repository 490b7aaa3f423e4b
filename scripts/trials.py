"""Shared code of the scripts that disturb `bp` and look at the files it leaves."""
import json, pathlib, sys


def make_pairs(folder, count, rng, size=(320, 240)):
    """Makes folders left and right of grey noise, with the right views shifted; returns their parent folder."""
    (width, height), shift = size, 7
    for side in ("left", "right"):
        (folder / side).mkdir(parents=True)
    for index in range(count):
        rows = [rng.randbytes(width + shift) for _ in range(height)]
        for side, start in (("left", 0), ("right", shift)):
            pixels = b"".join(row[start:start + width] for row in rows)
            (folder / side / f"{index:03}.pgm").write_bytes(b"P5\n%d %d\n255\n" % (width, height) + pixels)
    return folder


def calibration(width, height):
    """Cameras with lenses, one turned a little, as OpenCV writes them."""
    matrix = lambda name, data: f"{name}: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [{data}]\n"
    camera = f"50, 0, {width // 2}, 0, 50, {height // 2}, 0, 0, 1"
    return "".join(["%YAML:1.0\n---\n", matrix("M1", camera), matrix("M2", camera), "D1: [-0.05, 0.01, 0., 0., 0.]\n",
                    "D2: [-0.04, 0.01, 0., 0., 0.]\n", matrix("R", "1, -0.02, 0, 0.02, 1, 0, 0, 0, 1"), "T: [-100., 1., 0.5]\n"])


# Fields that depend on when and where a record was written.
OF_THE_MOMENT = ("elapsed_ms", "times", "modified_ns", "changed_ns", "path")


def lasting(told):
    """A record without the fields that depend on when and where it was written."""
    if isinstance(told, dict):
        return {name: lasting(value) for name, value in told.items() if name not in OF_THE_MOMENT}
    return [lasting(value) for value in told] if isinstance(told, list) else told


def contents(folder):
    """The contents of every file by its path: records without times and paths; None for the summary."""
    def content(path):
        if path == folder / "summary.json":
            return None
        is_record = folder / "records" in path.parents and path.suffix == ".json"
        try:
            return lasting(json.loads(path.read_bytes())) if is_record else path.read_bytes()
        except json.JSONDecodeError:
            return path.read_bytes()
    return {str(path.relative_to(folder)): content(path) for path in sorted(folder.rglob("*")) if path.is_file()}


def check(ok, what):
    if not ok:
        sys.exit(f"FAILED: {what}")
