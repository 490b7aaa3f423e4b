"""What `--stretch` does to pairs whose 16 bits are not used in full: bad 1.0 of all pixels, in percent. Writes stretch.md beside this file.

Usage: python measure.py BP FOLDER (the scenes of middlebury-v3-quarter; needs OpenCV and NumPy)
"""
import json
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy

bp, scenes = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()


def bad(folder, truth, *arguments):
    command = [bp, "match", *arguments, "-o", "map.pfm", "--json", "--quiet", "--ground-truth", truth]
    done = subprocess.run(list(map(str, command)), cwd=folder, check=True, capture_output=True, text=True)
    return json.loads(done.stdout)["errors"]["all"]["bad"][1]


rows = []
for scene in sorted(path.parent for path in scenes.glob("*/im0.png")):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for side, file in (("left", "im0.png"), ("right", "im1.png")):
            grey = cv2.imread(str(scene / file), cv2.IMREAD_GRAYSCALE)
            cv2.imwrite(str(folder / f"{side}8.png"), grey)
            cv2.imwrite(str(folder / f"{side}16.png"), grey.astype(numpy.uint16) * 3 + 212)
            floats = grey.astype(numpy.float32) * 3.7 - 212
            floats[:10] = numpy.nan if side == "left" else floats[:10]
            cv2.imwrite(str(folder / f"{side}.tif"), floats)
        truth = scene / "disp0GT.pfm"
        rows.append([scene.name] + [bad(folder, truth, *words.split()) for words in (
            "left8.png right8.png", "left16.png right16.png", "left16.png right16.png --stretch", "left.tif right.tif --stretch")])
rows.append(["mean"] + [numpy.mean(column) for column in list(zip(*rows))[1:]])
lines = ["| scene | 8 bits | 16 bits, 212 to 977 | the same, `--stretch` | floats, the first ten rows missing, `--stretch` |", "|---|---|---|---|---|"]
lines += ["| " + " | ".join([name, *(f"{value:.2f}" for value in values)]) + " |" for name, *values in rows]
text = "\n".join(["# Values that do not use their bits in full", "", "Bad 1.0 of all pixels, in percent, of the default matcher (`measure.py` in this folder).", "", *lines])
(pathlib.Path(__file__).parent / "stretch.md").write_text(text + "\n")
