"""The plug-in for Pandora, in its own pipeline and through its own command."""
import json
import pathlib
import subprocess
import sys

import bpstereo
import numpy
import pytest

pytest.importorskip("pandora")
rasterio = pytest.importorskip("rasterio")

from conftest import shifted  # noqa: E402


pytestmark = pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")


def save(path, array, **profile):
    height, width = array.shape
    with rasterio.open(path, "w", driver="GTiff", height=height, width=width, count=1, dtype=array.dtype, **profile) as file:
        file.write(array, 1)
    return str(path)


def run(folder, pipeline, disparity, left=None, right=None, mask=None):
    """Pandora's own command on a pair with the disparity 5: -5 in Pandora's sign."""
    one, other = shifted(60, 100, 5)
    inputs = {
        side: {"img": save(folder / f"{side}.tif", image.astype(numpy.float32) * 7 + 300), "disp": disparity, "nodata": -9999}
        for side, image in (("left", one), ("right", other))
    }
    inputs["right"].pop("disp")
    if mask is not None:
        inputs["left"]["mask"] = save(folder / "mask.tif", mask.astype(numpy.uint8))
    (folder / "config.json").write_text(json.dumps({"input": inputs, "pipeline": pipeline}))
    command = pathlib.Path(sys.executable).with_name("pandora")
    done = subprocess.run([command, "config.json", "out"], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    with rasterio.open(folder / "out" / "left_disparity.tif") as file:
        return file.read(1)


PIPELINE = {
    "matching_cost": {"matching_cost_method": "census", "window_size": 5},
    "disparity": {"disparity_method": "bpstereo", "invalid_disparity": -9999},
}


def test_its_own_command_runs_our_step(tmp_path):
    found = run(tmp_path, PIPELINE, [-12, 0])
    assert abs(numpy.median(found[found != -9999]) + 5) < 0.1


def test_disparity_grids_and_masks_hold(tmp_path):
    mask = numpy.zeros((60, 100), bool)
    mask[20:30, 40:60] = True
    found = run(tmp_path, PIPELINE, [-4, 0], mask=mask)
    assert (found[mask] == -9999).all()
    rest = found[found != -9999]
    assert rest.min() >= -4 and rest.max() <= 0


def test_cross_checking_uses_it_for_the_right_image_too(tmp_path):
    pipeline = PIPELINE | {"validation": {"validation_method": "cross_checking_accurate"}}
    found = run(tmp_path, pipeline, [-12, 0])
    assert abs(numpy.median(found[found != -9999]) + 5) < 0.1
    assert (tmp_path / "out" / "right_disparity.tif").exists()
