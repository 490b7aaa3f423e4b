"""StereoBP in the place of StereoSGBM."""
import bpstereo
import numpy
import pytest

from conftest import ROOT, shifted

cv2 = pytest.importorskip("cv2")
SAMPLE = ROOT / "bench-data" / "sample"


def run(create):
    """A script for StereoSGBM; `create` is the line that changes."""
    left, right = (cv2.imread(str(SAMPLE / f"{side}.png")) for side in ("left", "right"))
    matcher = create(minDisparity=0, numDisparities=64)
    return matcher.compute(left, right)


def test_one_line_changes():
    theirs, ours = run(cv2.StereoSGBM.create), run(bpstereo.StereoBP.create)
    assert ours.dtype == theirs.dtype and ours.shape == theirs.shape
    both = (theirs >= 0) & (ours >= 0)
    assert both.mean() > 0.5 and numpy.median(abs(theirs[both] - ours[both])) <= 8


def test_colours_are_opencvs():
    left, right = (bpstereo.read_image(SAMPLE / f"{side}.png") for side in ("left", "right"))
    expected = bpstereo.match(left, right, labels=64, min_disparity=0, quality="best", fill=False)
    found = bpstereo.StereoBP.create(0, 64, quality="best").compute(left[..., ::-1], right[..., ::-1])
    stored = numpy.round(numpy.nan_to_num(expected, nan=-1) * 16).astype(numpy.int16)
    assert (found == stored).all()


def test_unknown_pixels_are_one_below_the_first_disparity():
    left, right = shifted(60, 80, 5)
    right[20:40, 20:40] = 255 - right[20:40, 20:40]
    for first in (0, -8):
        found = bpstereo.StereoBP.create(first, 24, disp12MaxDiff=1, speckleWindowSize=50).compute(left, right)
        assert (found == (first - 1) * 16).any() and abs(numpy.median(found) - 80) <= 4
    out = numpy.zeros((60, 80), numpy.int16)
    assert bpstereo.StereoBP.create(0, 16).compute(left, right, out) is out and out.any()


def test_parameters_without_counterpart_are_told():
    with pytest.warns(UserWarning, match="P1, uniquenessRatio"):
        bpstereo.StereoBP.create(0, 16, P1=200, uniquenessRatio=10)
    with pytest.raises(ValueError, match="int16"):
        bpstereo.StereoBP.create(0, 4096)
    matcher = bpstereo.StereoBP.create(-3, 32)
    assert (matcher.getMinDisparity(), matcher.getNumDisparities()) == (-3, 32)
