"""StereoBP in the place of StereoSGBM."""
import warnings

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
    for first, check in [(0, "disp12MaxDiff"), (-8, "disp12MaxDiff"), (0, "uniquenessRatio")]:
        found = bpstereo.StereoBP.create(first, 24, speckleWindowSize=50, **{check: 1}).compute(left, right)
        assert (found == (first - 1) * 16).any() and abs(numpy.median(found) - 80) <= 4
    assert (bpstereo.StereoBP.create(0, 24).compute(left, right) >= 0).all()
    out = numpy.zeros((60, 80), numpy.int16)
    assert bpstereo.StereoBP.create(0, 16).compute(left, right, out) is out and out.any()


def test_parameters_without_counterpart_are_told():
    with pytest.warns(UserWarning, match="P1, preFilterCap"):
        bpstereo.StereoBP.create(0, 16, P1=200, preFilterCap=10)
    with pytest.raises(ValueError, match="int16"):
        bpstereo.StereoBP.create(0, 4096)
    matcher = bpstereo.StereoBP.create(-3, 32)
    assert (matcher.getMinDisparity(), matcher.getNumDisparities()) == (-3, 32)


def methods(kind):
    return {name for name in dir(kind) if not name.startswith("_")}


def test_every_method_of_stereosgbm_exists():
    # Those of OpenCV's Algorithm store matchers in files.
    missing = methods(cv2.StereoSGBM) - methods(cv2.Algorithm) - methods(bpstereo.StereoBP)
    assert not missing and len(methods(cv2.StereoSGBM) - methods(cv2.Algorithm)) > 20


@pytest.mark.filterwarnings("ignore:without effect")
def test_getters_return_what_was_given():
    theirs, ours = cv2.StereoSGBM.create(), bpstereo.StereoBP.create()
    getters = sorted(name for name in methods(theirs) - methods(cv2.Algorithm) if name.startswith("get"))
    all_of = lambda matcher: [getattr(matcher, name)() for name in getters]
    assert all_of(ours) == all_of(theirs), "OpenCV's defaults"
    for matcher in (ours, theirs):
        for index, name in enumerate(getters):
            getattr(matcher, name.replace("get", "set"))(16 * (index + 1))
    assert all_of(ours) == all_of(theirs) and len(set(all_of(ours))) == len(getters) == 11
    # Without keywords, too.
    assert all_of(bpstereo.StereoBP.create(*range(1, 12))) == all_of(cv2.StereoSGBM.create(*range(1, 12)))


def test_setters_mean_what_the_parameters_mean():
    left, right = shifted(60, 80, 5)
    right[20:40, 20:40] = 255 - right[20:40, 20:40]
    given = {"minDisparity": -8, "numDisparities": 24, "disp12MaxDiff": 1, "speckleWindowSize": 50}
    expected = bpstereo.StereoBP.create(**given).compute(left, right)
    matcher = bpstereo.StereoBP.create()
    assert not numpy.array_equal(matcher.compute(left, right), expected)
    # Between the two, the disparities would not fit.
    matcher.setMinDisparity(2040)
    for name, value in given.items():
        before = matcher.compute(left, right) if name != "minDisparity" else None
        getattr(matcher, f"set{name[0].upper()}{name[1:]}")(value)
        assert before is None or not numpy.array_equal(matcher.compute(left, right), before), name
    assert numpy.array_equal(matcher.compute(left, right), expected)
    matcher.setNumDisparities(4096)
    with pytest.raises(ValueError, match="int16"):
        matcher.compute(left, right)


def test_a_setter_without_effect_warns_once():
    left, right = shifted(60, 80, 5)
    matcher = bpstereo.StereoBP.create(0, 16)
    expected = matcher.compute(left, right)
    with pytest.warns(UserWarning, match="P1") as caught:
        matcher.setP1(200)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        matcher.setP1(300)
        matcher.setP2(0)
        matcher.setSpeckleWindowSize(0)
    assert matcher.getP1() == 300 and numpy.array_equal(matcher.compute(left, right), expected)


def cloud(create):
    """A script in the style of OpenCV's samples/python/stereo_match.py; `create` is the line that changes."""
    left, right = (cv2.imread(str(SAMPLE / f"{side}.png")) for side in ("left", "right"))
    window_size, min_disp, num_disp = 3, 0, 48
    stereo = create(minDisparity=min_disp, numDisparities=num_disp, blockSize=16, P1=8 * 3 * window_size**2, P2=32 * 3 * window_size**2,
                    disp12MaxDiff=1, uniquenessRatio=10, speckleWindowSize=100, speckleRange=32)
    disp = stereo.compute(left, right).astype(numpy.float32) / 16
    height, width = left.shape[:2]
    q = numpy.float32([[1, 0, 0, -width / 2], [0, -1, 0, height / 2], [0, 0, 0, -0.8 * width], [0, 0, 1, 0]])
    points, is_known = cv2.reprojectImageTo3D(disp, q), disp > disp.min()
    return points[..., 2], is_known, (disp - min_disp) / num_disp


def test_opencvs_sample_runs_with_one_line_changed():
    with pytest.warns(UserWarning, match="blockSize, P1, P2, speckleRange"):
        ours, is_known, shown = cloud(bpstereo.StereoBP.create)
    theirs, is_known_there, _ = cloud(cv2.StereoSGBM_create)
    assert 0 < is_known.mean() < 1 and shown[is_known].min() >= 0 and shown[is_known].max() <= 1
    both = is_known & is_known_there
    assert both.mean() > 0.4 and numpy.median(abs(ours[both] / theirs[both] - 1)) < 0.05
