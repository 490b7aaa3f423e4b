"""Reads what `bp` records about batches, alignments and speed with Python's json. Part of scripts/check-formats."""
import hashlib, json, math, pathlib, shutil, statistics

from public_pairs import ROOT
from trials import check

SAMPLE = ROOT / "bench-data" / "sample"
LABELS = 40


def records(folder, bp):
    return batch(folder, bp) + alignment(folder, bp) + speed(folder, bp)


def batch(folder, bp):
    """The records and the summary of two pairs, and of a third one that cannot be read."""
    for name in ("a", "b", "broken"):
        (folder / "pairs" / name).mkdir(parents=True)
        for side in ("left", "right"):
            shutil.copy(SAMPLE / f"{side}.png", folder / "pairs" / name)
    (folder / "pairs" / "broken" / "right.png").write_bytes(b"not an image")
    bp("match", "--pairs", "pairs", "-o", "maps", "--format", "npy", "--also", "picture,confidence", "--labels", LABELS, expected=3)
    out = folder / "maps"
    found = {name: json.loads((out / "records" / f"{name}.json").read_text()) for name in ("a/left", "b/left")}
    check(len(list(out.rglob("records/**/*.json"))) == len(found), "a record for each pair that was matched")
    for name, record in found.items():
        recorded(folder, out, name, record)
    summary = json.loads((out / "summary.json").read_text())
    summed(list(found.values()), summary)
    failure, = summary["failures"]
    about = {"name": "broken/left", "left": "pairs/broken/left.png", "right": "pairs/broken/right.png"}
    check(about.items() <= failure.items() and failure["failure"].startswith(about["right"]), "summary.json: the failure")
    return ["records of pairs: json", "summary.json: json"]


def recorded(folder, out, name, record):
    """A record names its images and all files of its pair, as they are."""
    import numpy
    done = record["done"]
    for file in record["inputs"] + done["outputs"]:
        path = pathlib.Path(file["path"])
        data, about = path.read_bytes(), path.stat()
        check(file["sha256"] == hashlib.sha256(data).hexdigest() and file["bytes"] == len(data), f"record: sum of {path.name}")
        check((file["modified_ns"], file["changed_ns"]) == (about.st_mtime_ns, about.st_ctime_ns), f"record: times of {path.name}")
    check([file["path"] for file in record["inputs"]] == [str(folder / record[side]) for side in ("left", "right")], "record: images")
    outputs = sorted(pathlib.Path(file["path"]) for file in done["outputs"])
    check(outputs == sorted((out / name).parent.iterdir()) and len(outputs) == 6, "record: outputs")
    height, width = numpy.load(out / f"{name}.npy").shape
    check((done["width"], done["height"]) == (width, height), "record: size")
    check(record["name"] == name and done["settings"]["labels"] == LABELS, "record: name and labels")
    energy = done["energy"]
    check(energy["total"] == energy["data"] + energy["smoothness"] > 0, "record: energy")
    check(done["times"]["match_ms"] >= done["times"]["solve_ms"] > 0, "record: times")


def summed(found, summary):
    """A summary gives sums, rates and settings of its records."""
    check((summary["pairs"], summary["done"]) == (len(found) + 1, len(found)), "summary.json: pairs")
    times = [record["done"]["times"] for record in found]
    for name, total in summary["times"].items():
        check(math.isclose(total, sum(time[name] for time in times)), f"summary.json: {name}")
    check(summary["median_solve_ms"] == statistics.median_low(time["solve_ms"] for time in times), "summary.json: median")
    check(math.isclose(summary["solved_per_second"], 1e3 * len(found) / summary["times"]["solve_ms"]), "summary.json: solved a second")
    check(math.isclose(summary["pairs_per_second"], 1e3 * len(found) / summary["total_ms"]), "summary.json: pairs a second")
    check(math.isclose(summary["total_ms"], sum(record["elapsed_ms"] for record in found)), "summary.json: total")
    of_pair = lambda settings: {name: value for name, value in settings.items() if name != "rows"}
    check(summary["settings"] == [of_pair(found[0]["done"]["settings"])], "summary.json: settings")


def alignment(folder, bp):
    """The alignment of a pair whose right view OpenCV moved down, and the sidecar of its map."""
    import cv2, numpy
    right, moved = cv2.imread(str(SAMPLE / "right.png")), 0.75
    height, width = right.shape[:2]
    cv2.imwrite(str(folder / "low.png"), cv2.warpAffine(right, numpy.array([[1, 0, 0], [0, 1, moved]]), (width, height),
                                                           borderMode=cv2.BORDER_REPLICATE))
    match = ("match", SAMPLE / "left.png", "low.png", "--labels", LABELS, "--align", "camera.json")
    bp(*match, "-o", "measured.npy")
    found = json.loads((folder / "camera.json").read_text())
    check((found["width"], found["height"]) == (width, height), "alignment: size")
    constant, *others = found["coefficients"]
    check(len(others) == 5 and abs(constant - moved) < 0.1 > max(map(abs, others)), f"alignment: {found['coefficients']}")
    bp(*match, "-o", "read.npy")
    check((folder / "read.npy").read_bytes() == (folder / "measured.npy").read_bytes(), "alignment: measured and read")
    rows = json.loads((folder / "read.npy.json").read_text())["plan"]["rows"]
    check(rows["corrected"] and rows["coefficients"] == found["coefficients"], "alignment: sidecar")
    check(rows["range"][0] - 0.1 < moved < rows["range"][1] + 0.1, "alignment: range")
    return ["alignment: json and OpenCV"]


def speed(folder, bp):
    """The times of two contestants, and the page about them."""
    names = ["rayon@1", "rayon@2"]
    bp("speed", "--backend", ",".join(names), "--problem", "sweep", "--quick", "--rounds", 3, "--output", "speed")
    found = json.loads((folder / "speed" / "speed.json").read_text())
    check([contestant["name"] for contestant in found["contestants"]] == names and found["quick"], "speed.json: contestants")
    contest, = found["contests"]
    check(contest["problem"] == "sweep" and found["rounds"] == 3, "speed.json: problem and rounds")
    check([entry["contestant"] for entry in contest["entries"]] == names and len(contest["labels_sha256"]) == 64, "speed.json: entries")
    page = (folder / "speed" / "speed.md").read_text()
    for entry in contest["entries"]:
        samples = entry["outcome"]["measured"]["samples"]
        check([sample["round"] for sample in samples] == [0, 1, 2], "speed.json: rounds")
        for sample in samples:
            check(sum(sample["clocks"][0]["stages"].values()) <= sample["total_ms"], "speed.json: stages")
        row = next(line for line in page.splitlines() if line.startswith(f"| sweep | {entry['contestant']} | 3 |"))
        median = statistics.median(sample["total_ms"] for sample in samples)
        shown = float(row.split("|")[4].split()[0])
        check(abs(shown / median - 1) < 0.006, f"speed.md: {shown} for {median}")
    return ["speed.json: json", "speed.md: medians of speed.json"]
