"""The method in stereodemo: called as the viewer calls it, without a window."""
import importlib.machinery
import importlib.util
import sys
from unittest import mock

import bpstereo
import numpy
import pytest

#: What stereodemo needs for windows and for other methods.
ELSEWHERE = {"open3d", "torch", "torchvision", "onnxruntime", "einops", "PIL"}


class Standing(mock.MagicMock):
    """Stands for a module and for every name in it, also for a base class."""
    __path__ = []

    def __mro_entries__(self, bases):
        return (object,)


class Finder:
    """Finds modules that stand for those that are missing."""
    @staticmethod
    def find_spec(name, path=None, target=None):
        return importlib.machinery.ModuleSpec(name, Finder, is_package=True) if name.partition(".")[0] in ELSEWHERE else None

    @staticmethod
    def create_module(spec):
        return Standing(name=spec.name)

    @staticmethod
    def exec_module(module):
        pass


@pytest.fixture(scope="module")
def stereodemo():
    if importlib.util.find_spec("stereodemo") is None:
        pytest.skip("stereodemo is not installed")
    with mock.patch.dict(sys.modules), mock.patch.object(sys, "meta_path", [*sys.meta_path, Finder]):
        import bpstereo.stereodemo
        yield bpstereo.stereodemo


@pytest.fixture
def input_pair(stereodemo):
    """Colour images, blue first; left pixels have the disparity 3."""
    scene = numpy.random.default_rng(2).integers(0, 256, (48, 67, 3), dtype=numpy.uint8)
    methods = sys.modules["stereodemo.methods"]
    calibration = methods.Calibration(64, 48, 50.0, 50.0, 32.0, 32.0, 24.0, 0.1)
    return methods.InputPair(scene[:, :64].copy(), scene[:, 3:].copy(), calibration, "")


@pytest.fixture
def method(stereodemo):
    return stereodemo.BeliefPropagation(stereodemo.Config("models"))


@pytest.mark.parametrize(("quality", "labels"), [("balanced", 0), ("fast", 16), ("best", 1)])
def test_maps_are_those_of_the_library(method, input_pair, quality, labels):
    method.parameters["Quality"].set_value(quality)
    method.parameters["Labels"].set_value(labels)
    answer = method.compute_disparity(input_pair)
    left, right = input_pair.left_image[..., ::-1], input_pair.right_image[..., ::-1]
    expected = bpstereo.match(left, right, quality=quality, labels=labels or "auto")
    assert numpy.array_equal(answer.disparity_pixels, numpy.nan_to_num(expected, nan=-1))
    assert answer.computation_time > 0 and answer.color_image_bgr is input_pair.left_image


def test_the_viewer_computes_right_depths(method, input_pair):
    disparity = method.compute_disparity(input_pair).disparity_pixels
    depth = method.depth_meters_from_disparity(disparity, input_pair.calibration)
    assert abs(numpy.median(depth[:, 8:]) - 0.1 * 50 / 3) < 0.05


def test_the_viewer_lists_the_method_first(stereodemo, tmp_path, monkeypatch):
    """Its own main function runs up to the window."""
    cv2 = pytest.importorskip("cv2")
    shown = []

    class Window:
        def __init__(self, methods, source):
            shown.append((list(methods), source.num_pairs))

        def update_once(self):
            return False

    for name in ("left.png", "right.png"):
        cv2.imwrite(str(tmp_path / name), numpy.zeros((9, 9), numpy.uint8))
    arguments = ["stereodemo", str(tmp_path / "left.png"), str(tmp_path / "right.png"), "--models-path", str(tmp_path)]
    monkeypatch.setattr(stereodemo.visualizer, "Visualizer", Window)
    monkeypatch.setattr(sys, "argv", arguments)
    stereodemo.main()
    [(methods, pairs)] = shown
    assert methods[:3] == ["Belief propagation", "OpenCV BM", "OpenCV SGBM"] and pairs == 1
