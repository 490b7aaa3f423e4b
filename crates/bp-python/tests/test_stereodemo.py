"""The method in stereodemo: called as the viewer calls it, without a window."""
import sys
import types

import bpstereo
import numpy
import pytest

methods = pytest.importorskip("stereodemo.methods")
from bpstereo import stereodemo  # noqa: E402


@pytest.fixture
def input_pair():
    """Colour images, blue first; left pixels have the disparity 3."""
    scene = numpy.random.default_rng(2).integers(0, 256, (48, 67, 3), dtype=numpy.uint8)
    calibration = methods.Calibration(64, 48, 50.0, 50.0, 32.0, 32.0, 24.0, 0.1)
    return methods.InputPair(scene[:, :64].copy(), scene[:, 3:].copy(), calibration, "")


def test_maps_are_those_of_the_library_and_depths_are_right(input_pair):
    method = stereodemo.BeliefPropagation(methods.Config("models"))
    for quality, labels in [("balanced", 0), ("fast", 16), ("best", 1)]:
        method.parameters["Quality"].set_value(quality)
        method.parameters["Labels"].set_value(labels)
        answer = method.compute_disparity(input_pair)
        left, right = input_pair.left_image[..., ::-1], input_pair.right_image[..., ::-1]
        expected = bpstereo.match(left, right, quality=quality, labels=labels or None)
        assert numpy.array_equal(answer.disparity_pixels, numpy.nan_to_num(expected, nan=-1)), quality
        assert answer.computation_time > 0 and answer.color_image_bgr is input_pair.left_image
    method.reset_defaults()
    disparity = method.compute_disparity(input_pair).disparity_pixels
    depth = methods.StereoMethod.depth_meters_from_disparity(disparity, input_pair.calibration)
    assert abs(numpy.median(depth[:, 8:]) - 0.1 * 50 / 3) < 0.05


def test_the_viewer_lists_the_method_first(monkeypatch):
    shown = []
    theirs = methods.StereoMethod("theirs", "", {}, methods.Config("models"))
    viewer = types.ModuleType("stereodemo.main")
    viewer.visualizer = types.SimpleNamespace(Visualizer=lambda methods, source: shown.append((list(methods), source)))
    viewer.main = lambda: viewer.visualizer.Visualizer({"theirs": theirs}, "source")
    # Its main module needs a window, Open3D and PyTorch.
    monkeypatch.setitem(sys.modules, "stereodemo.main", viewer)
    monkeypatch.setattr(sys.modules["stereodemo"], "main", viewer, raising=False)
    stereodemo.main()
    assert shown == [(["Belief propagation", "theirs"], "source")]
