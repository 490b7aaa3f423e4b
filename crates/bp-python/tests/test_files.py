"""Files, depth and points: the formats of the program, read and written from Python."""
import subprocess

import bpstereo
import numpy
import pytest

from conftest import ROOT

SAMPLE = ROOT / "bench-data" / "sample"
MAP = numpy.array([[1, 2.5, numpy.nan], [4, 100.25, 0.5]], numpy.float32)


@pytest.mark.parametrize("ending", ["pfm", "tif", "npy", "png"])
def test_maps_survive_every_format(tmp_path, ending):
    path = tmp_path / f"map.{ending}"
    bpstereo.write_map(path, MAP)
    assert numpy.array_equal(bpstereo.read_map(str(path)), MAP, equal_nan=True)


def test_errors_name_the_file(tmp_path):
    for call in [bpstereo.read_image, bpstereo.read_map, bpstereo.Calibration.read]:
        with pytest.raises(FileNotFoundError, match="nowhere.png"):
            call(tmp_path / "nowhere.png")
        (tmp_path / "broken.png").write_bytes(b"\x89PNG")
        with pytest.raises(ValueError, match="broken.png"):
            call(tmp_path / "broken.png")
    with pytest.raises(ValueError, match="map.doc"):
        bpstereo.write_map(tmp_path / "map.doc", MAP)
    with pytest.raises(IsADirectoryError):
        bpstereo.read_image(tmp_path)
    with pytest.raises(ValueError, match=".png"):
        bpstereo.write_picture(tmp_path / "map.jpg", MAP)
    bpstereo.write_map(tmp_path / "map.pfm", MAP)
    with pytest.raises(ValueError, match="max_megapixels"):
        bpstereo.read_map(tmp_path / "map.pfm", max_megapixels=0)
    with pytest.raises(FileNotFoundError, match="nowhere"):
        bpstereo.write_map(tmp_path / "nowhere" / "map.pfm", MAP)
    with pytest.raises(TypeError, match="float32"):
        bpstereo.write_map(tmp_path / "map.pfm", MAP.astype(numpy.float64))


def test_depth_and_points_are_those_of_the_program(program, tmp_path):
    left = SAMPLE / "left.png"
    bp = lambda *words: subprocess.run([program, *map(str, words), "--quiet"], cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)
    bp("match", left, SAMPLE / "right.png", "--output", "map.npy", "--calib", SAMPLE / "calib.txt", "--depth", "depth.npy",
       "--points", "cloud.ply", "--picture", "map.png", "--no-colour-bar", "--unknown", "nan")
    disparity = bpstereo.read_map(tmp_path / "map.npy")
    calibration = bpstereo.Calibration.read(SAMPLE / "calib.txt")
    depth = numpy.load(tmp_path / "depth.npy")
    assert numpy.array_equal(calibration.depth(disparity), depth, equal_nan=True)
    assert numpy.array_equal(calibration.points(disparity)[..., 2], depth, equal_nan=True)
    bpstereo.write_points(tmp_path / "ours.ply", disparity, bpstereo.read_image(left), calibration)
    assert (tmp_path / "ours.ply").read_bytes() == (tmp_path / "cloud.ply").read_bytes()
    bpstereo.write_picture(tmp_path / "ours.png", disparity)
    assert (bpstereo.read_image(tmp_path / "ours.png") == bpstereo.read_image(tmp_path / "map.png")).all()


def test_depth_and_points_of_middleburys_calibrations_are_those_of_opencv(tmp_path):
    """The two cameras' principal points differ: doffs."""
    cv2 = pytest.importorskip("cv2")
    focal, column, row, doffs, baseline = 994.978, 311.193, 254.877, 31.086, 193.001
    (tmp_path / "calib.txt").write_text(
        f"cam0=[{focal} 0 {column}; 0 {focal} {row}; 0 0 1]\ncam1=[{focal} 0 {column + doffs}; 0 {focal} {row}; 0 0 1]\n"
        f"doffs={doffs}\nbaseline={baseline}\nwidth=741\nheight=497\nndisp=70\nisint=0\nvmin=5\nvmax=60\n")
    calibration = bpstereo.Calibration.read(tmp_path / "calib.txt")
    disparity = numpy.random.default_rng(4).uniform(5, 60, (497, 741)).astype(numpy.float32)
    # The depth is f b / (d + doffs).
    q = numpy.array([[1, 0, 0, -column], [0, 1, 0, -row], [0, 0, 0, focal], [0, 0, 1 / baseline, doffs / baseline]])
    expected = cv2.reprojectImageTo3D(disparity, q)
    assert numpy.allclose(calibration.depth(disparity), focal * baseline / (disparity + doffs), rtol=1e-5)
    assert numpy.allclose(calibration.points(disparity), expected, rtol=1e-4, atol=1e-2)
    disparity[0, 0], disparity[0, 1] = numpy.nan, -doffs
    assert numpy.isnan(calibration.points(disparity)[0, :2]).all() and numpy.isfinite(calibration.points(disparity)[0, 2]).all()


def test_calibrations_are_checked():
    calibration = bpstereo.Calibration(500, 60, doffs=2, principal_point=(10, 20))
    assert (calibration.focal, calibration.baseline, calibration.doffs) == (500, 60, 2)
    assert calibration.principal_point == (10, 20)
    assert calibration.depth(MAP)[0, 0] == 500 * 60 / 3
    for wrong in [(0, 1), (1, -1), (1, 1, numpy.nan)]:
        with pytest.raises(ValueError):
            bpstereo.Calibration(*wrong)
