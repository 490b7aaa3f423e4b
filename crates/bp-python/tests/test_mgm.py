"""The command `bp-mgm`, called as s2p and the Ames Stereo Pipeline call mgm."""
import os
import pathlib
import subprocess
import sys

import numpy
import pytest

rasterio = pytest.importorskip("rasterio")

import bpstereo  # noqa: E402
from bpstereo import mgm  # noqa: E402
from conftest import ROOT, shifted  # noqa: E402

pytestmark = pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")

# The arguments that s2p makes for its algorithms mgm and mgm_multi (s2p/block_matching.py), and its environment variables.
# The Ames Stereo Pipeline asks for no confidence (stereo_corr.cc, LocalAlignment.cc); its variables are among these.
CALLS = {
    "asp": "-O 8 -s vfit -t census -r {low} -R {high} {left} {right} {map}",
    "mgm": "-r {low} -R {high} -s vfit -t census -O 8 -confidence_consensusL {trust} {left} {right} {map}",
    "mgm_multi": "-r {low} -R {high} -S 6 -s vfit -t census -O 8 -P1 8.0 -P2 32.0 -confidence_consensusL {trust} {left} {right} {map}",
}
ENVIRONMENT = {
    "OMP_NUM_THREADS": "1", "MEDIAN": "1", "CENSUS_NCC_WIN": "5", "TSGM": "3", "TESTLRRL": "1", "TESTLRRL_TAU": "1.0",
    "MINDIFF": "-1", "REMOVESMALLCC": "25", "SUBPIX": "2", "USE_TRUNCATED_LINEAR_POTENTIALS": "1",
}


def save(path, values, **profile):
    with rasterio.open(path, "w", driver="GTiff", height=values.shape[0], width=values.shape[1], count=1, dtype=values.dtype,
                       **profile) as file:
        file.write(values, 1)


def load(path):
    with rasterio.open(path) as file:
        return file.read(1)


@pytest.fixture
def scene(tmp_path):
    """A pair as from a satellite: floats beyond 8 bits, NaN beside the scene; ours are 5, so mgm's disparities are -5."""
    left, right = (200 + 7 * image.astype(numpy.float32) for image in shifted(60, 100, 5))
    left[:4] = numpy.nan
    right[50:55, 60:80] = numpy.nan
    save(tmp_path / "left.tif", left, compress="lzw")
    save(tmp_path / "right.tif", right)
    return tmp_path


def run(folder, arguments, environment=()):
    """The command, in an interpreter of its own."""
    command = [sys.executable, "-c", "import sys, bpstereo.mgm as mgm; sys.exit(mgm.main())", *arguments.split()]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, env={**os.environ, **dict(environment)})


@pytest.mark.parametrize("algorithm", CALLS)
def test_the_command_lines_of_both_pipelines_give_maps_as_mgm_does(scene, algorithm):
    files = {"left": "left.tif", "right": "right.tif", "map": "disp.tif", "trust": "disp_confidence.tif"}
    done = run(scene, CALLS[algorithm].format(low=-12, high=3, **files), ENVIRONMENT)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    found = load(scene / "disp.tif")
    assert found.dtype == numpy.float32 and found.shape == (60, 100)
    known = numpy.isfinite(found)
    assert not known[:4].any(), "the left image has no values there"
    assert known.mean() > 0.75 and abs(numpy.median(found[known]) + 5) < 0.05
    assert numpy.mean(abs(found[known] + 5) < 0.5) > 0.98
    names = {"left.tif", "right.tif", "disp.tif"}
    if "{trust}" in CALLS[algorithm]:
        names.add("disp_confidence.tif")
        trust = load(scene / "disp_confidence.tif")
        assert numpy.nanmin(trust) >= 0 and numpy.nanmax(trust) <= 1 and numpy.nanmedian(trust) > 0.8
    assert {path.name for path in scene.iterdir()} == names


def test_what_the_right_image_does_not_show_is_unknown_unless_the_check_is_off(scene):
    """As s2p 1.0b25 calls mgm: without TESTLRRL, which mgm takes for 1."""
    known = {}
    for check in ("", "0"):
        done = run(scene, CALLS["asp"].format(low=-12, high=3, left="left.tif", right="right.tif", map="disp.tif"), {"TESTLRRL": check})
        assert done.returncode == 0, done.stderr
        known[check] = numpy.isfinite(load(scene / "disp.tif")[4:])
    assert known[""][:, :5].mean() < 0.2 and known[""].mean() > 0.75
    assert known["0"].all()


def test_the_lines_without_python_give_the_same_map(scene, program):
    page = (ROOT / "docs" / "python.md").read_text()
    lines = page[page.index("**Without Python**"):].split("```")[1].removeprefix("sh\n")
    path = f"{program.parent}{os.pathsep}{os.environ['PATH']}"
    left, right = load(scene / "left.tif"), load(scene / "right.tif")
    for case, (low, high) in enumerate([(-12, 3), (-30, -2), (-12, 3), (-12, 3)]):
        # First with NaN, then with what GDAL takes for none.
        if case == 1:
            save(scene / "left.tif", numpy.nan_to_num(left, nan=-9999), nodata=-9999)
        if case == 2:
            save(scene / "left.tif", numpy.nan_to_num(left, nan=-3.4028234663852886e38), nodata=-3.40282e38)
        if case == 3:
            for name, image in [("left.tif", left), ("right.tif", right)]:
                save(scene / name, numpy.nan_to_num(image, nan=65535).astype(numpy.uint16), nodata=65535)
        arguments = ["-r", str(low), "-R", str(high), "left.tif", "right.tif"]
        subprocess.run(["sh", "-c", lines, "mgm", *arguments, "plain.tif"], cwd=scene, env=os.environ | {"PATH": path}, check=True)
        assert run(scene, " ".join([*arguments, "disp.tif"])).returncode == 0
        assert numpy.array_equal(load(scene / "plain.tif"), load(scene / "disp.tif"), equal_nan=True)
    assert not list(scene.glob("*.json"))


def test_images_of_different_sizes_are_matched_within_the_left_one(scene):
    save(scene / "right.tif", load(scene / "right.tif")[:50, :90].copy())
    done = run(scene, "-r -12 -R 3 left.tif right.tif disp.tif")
    assert done.returncode == 0, done.stderr
    assert load(scene / "disp.tif").shape == (60, 100)


def test_values_that_a_file_declares_as_missing_are_unknown(scene):
    left = numpy.nan_to_num(load(scene / "left.tif"), nan=-9999)
    save(scene / "left.tif", left, nodata=-9999)
    assert run(scene, "-r -12 -R 3 left.tif right.tif disp.tif").returncode == 0
    found = load(scene / "disp.tif")
    assert numpy.isnan(found[:4]).all() and abs(numpy.nanmedian(found) + 5) < 0.05


@pytest.mark.parametrize(("arguments", "code", "word"), [
    ("-r 3 -R -3 left.tif right.tif disp.tif", 1, "-r"),
    ("-r -3 -R 3 none.tif right.tif disp.tif", 1, "none.tif"),
    ("-r -3 -R 3 left.tif right.tif no/disp.tif", 1, "no"),
    ("-r -3 -R 3 -m low.tif left.tif right.tif disp.tif", 2, "-m"),
    ("-R 3 left.tif right.tif disp.tif", 2, "-r"),
])
def test_what_cannot_be_done_is_said_and_nothing_is_written(scene, arguments, code, word):
    before = sorted(scene.iterdir())
    done = run(scene, arguments)
    assert done.returncode == code and word in done.stderr and "Traceback" not in done.stderr
    assert sorted(scene.iterdir()) == before


def test_a_variable_that_is_no_number_is_named(scene):
    done = run(scene, "-r -3 -R 3 left.tif right.tif disp.tif", {"MEDIAN": "much"})
    assert done.returncode == 1 and "MEDIAN=much" in done.stderr


def test_the_package_installs_the_command():
    text = (pathlib.Path(__file__).parents[1] / "pyproject.toml").read_text()
    assert 'bp-mgm = "bpstereo.mgm:main"' in text and bpstereo.mgm.main is mgm.main
