#!/usr/bin/env python3
"""From a pair to a map, its confidence and a point cloud, step by step, as a page in Markdown with pictures.

    python tour.py LEFT RIGHT CALIB.TXT FOLDER

The page shows the code of each step, what it printed, and the pictures that it made.
"""
import contextlib
import io
import pathlib
import sys
import textwrap

STEPS = [
    ("A pair", """
        import bpstereo
        import numpy

        left, right = bpstereo.read_image(paths[0]), bpstereo.read_image(paths[1])
        print(left.shape, left.dtype)
    """),
    ("The map", """
        matcher = bpstereo.Matcher(quality="best", confidence=True)
        disparity = matcher.compute(left, right)
        print(f"{numpy.nanmin(disparity):.1f} to {numpy.nanmax(disparity):.1f} px on {matcher.device['name']}")
        print(f"{matcher.settings['labels']} labels from {matcher.settings['min_disparity']} px, found by itself")
        bpstereo.write_picture(folder / "map.png", disparity)
    """),
    ("How sure it is", """
        confidence = matcher.confidence
        print(f"{(confidence > 0.75).mean():.0%} of the pixels have a confidence above 0.75")
        bpstereo.write_picture(folder / "confidence.png", confidence)
    """),
    ("What is sure", """
        sure = numpy.where(confidence > 0.75, disparity, numpy.float32(numpy.nan))
        bpstereo.write_picture(folder / "sure.png", sure)
    """),
    ("Depth and points", """
        calibration = bpstereo.Calibration.read(paths[2])
        depth = calibration.depth(sure)
        print(f"{numpy.nanmin(depth) / 1000:.2f} to {numpy.nanmax(depth) / 1000:.2f} m")
        bpstereo.write_points(folder / "cloud.ply", sure, left, calibration)
    """),
]


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    *paths, folder = map(pathlib.Path, sys.argv[1:])
    folder.mkdir(parents=True, exist_ok=True)
    names = {"paths": paths, "folder": folder}
    page = "# A tour of bpstereo\n"
    for title, code in STEPS:
        code, printed, there = textwrap.dedent(code).strip(), io.StringIO(), set(folder.glob("*.png"))
        with contextlib.redirect_stdout(printed):
            exec(code, names)
        page += f"\n## {title}\n\n```python\n{code}\n```\n"
        if printed.getvalue():
            page += f"\n```text\n{printed.getvalue()}```\n"
        page += "".join(f"\n![{title}]({path.name})\n" for path in sorted(set(folder.glob("*.png")) - there))
    (folder / "tour.md").write_text(page)


main()
