#!/usr/bin/env python3
"""Shows a pair, its map and its point cloud in the Rerun viewer (pip install rerun-sdk).

    python rerun_viewer.py LEFT RIGHT CALIB.TXT [RECORDING.rrd]

With a fourth argument nothing opens; the recording is written there.
"""
import sys

import bpstereo
import numpy
import rerun


def main():
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__)
    left, right = map(bpstereo.read_image, sys.argv[1:3])
    calibration = bpstereo.Calibration.read(sys.argv[3])
    rerun.init("bpstereo", spawn=len(sys.argv) == 4)
    if len(sys.argv) == 5:
        rerun.save(sys.argv[4])
    disparity = bpstereo.match(left, right, quality="best")
    points = calibration.points(disparity) / 1000
    known = numpy.isfinite(points).all(axis=2)
    rerun.log("pair/left", rerun.Image(left))
    rerun.log("pair/right", rerun.Image(right))
    rerun.log("map", rerun.DepthImage(numpy.nan_to_num(calibration.depth(disparity)), meter=1000))
    rerun.log("world", rerun.ViewCoordinates.RDF, static=True)
    rerun.log("world/points", rerun.Points3D(points[known], colors=left[known]))


main()
