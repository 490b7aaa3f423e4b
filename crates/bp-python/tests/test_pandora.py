"""The plug-in for Pandora, in its own pipeline and through its own command."""
import json
import os
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


def run(folder, pipeline, disparity, mask=None):
    """The map of a pair with the disparity 5: -5 in Pandora's sign."""
    one, other = shifted(60, 100, 5)
    inputs = {
        side: {"img": save(folder / f"{side}.tif", image.astype(numpy.float32) * 7 + 300), "disp": disparity, "nodata": -9999}
        for side, image in (("left", one), ("right", other))
    }
    inputs["right"].pop("disp")
    if mask is not None:
        inputs["left"]["mask"] = save(folder / "mask.tif", mask.astype(numpy.uint8))
    return answer(folder, inputs, pipeline)


def answer(folder, inputs, pipeline):
    """The map that Pandora's own command makes."""
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


def test_a_grid_says_what_each_pixel_may_have(tmp_path):
    low = numpy.full((60, 100), -12, numpy.float32)
    high = numpy.where(numpy.arange(100) < 50, 0, -7).astype(numpy.float32) + numpy.zeros((60, 1), numpy.float32)
    with rasterio.open(tmp_path / "grid.tif", "w", driver="GTiff", height=60, width=100, count=2, dtype=low.dtype) as file:
        file.write(numpy.stack([low, high]))
    found = run(tmp_path, PIPELINE, str(tmp_path / "grid.tif"))
    left, right = found[:, 20:50], found[:, 50:]
    assert abs(numpy.median(left[left != -9999]) + 5) < 0.1
    # The true -5 is not allowed here; the nearest that is allowed is.
    assert right[right != -9999].max() <= -7 and abs(numpy.median(right[right != -9999]) + 7) < 0.1


def with_gaps(folder, contrast=7):
    """A pair with missing values in both images, and a mask for each."""
    left, right = (image.astype(numpy.float32) * contrast + 300 for image in shifted(60, 100, 5))
    left[:4], left[30:33, 50:60], right[50:55, 60:80], right[:, 95:] = -9999, -9999, -9999, -9999
    masks = numpy.zeros((2, 60, 100), numpy.uint8)
    masks[0, 20:30, 40:60] = masks[1, 40:48, 20:40] = 1
    inputs = {
        side: {"img": save(folder / f"{side}.tif", image), "nodata": -9999, "mask": save(folder / f"{side}-mask.tif", mask)}
        for side, image, mask in (("left", left, masks[0]), ("right", right, masks[1]))
    }
    inputs["left"]["disp"] = [-12, 0]
    return inputs


def test_the_invalid_pixels_and_why_they_are_is_as_with_pandoras_own_method(tmp_path):
    inputs, told = with_gaps(tmp_path), []
    for method in ("wta", "bpstereo"):
        disparity = PIPELINE["disparity"] | {"disparity_method": method}
        found = answer(tmp_path, inputs, PIPELINE | {"disparity": disparity})
        with rasterio.open(tmp_path / "out" / "left_validity_mask.tif") as file:
            told.append((found == -9999, file.read(1)))
    (theirs, their_reasons), (ours, our_reasons) = told
    assert 0.2 < theirs.mean() < 0.3 and len(numpy.unique(their_reasons)) > 10
    assert numpy.array_equal(ours, theirs) and numpy.array_equal(our_reasons, their_reasons)


def test_missing_values_do_not_change_the_scale_of_the_others(tmp_path):
    """Those of the scene differ by 5 at most; the missing ones are 10,000 less."""
    found = answer(tmp_path, with_gaps(tmp_path, contrast=0.02), PIPELINE)
    known = found != -9999
    # Pixels whose counterpart is hidden have another disparity.
    assert numpy.mean(abs(found[known] + 5) < 0.5) > 0.85


def test_cross_checking_uses_it_for_the_right_image_too(tmp_path):
    pipeline = PIPELINE | {"validation": {"validation_method": "cross_checking_accurate"}}
    found = run(tmp_path, pipeline, [-12, 0])
    assert abs(numpy.median(found[found != -9999]) + 5) < 0.1
    assert (tmp_path / "out" / "right_disparity.tif").exists()


@pytest.mark.skipif("BP_DATA" not in os.environ, reason="BP_DATA is not set")
def test_on_pandoras_example_ours_is_right_more_often(tmp_path):
    """Cones (Scharstein and Szeliski 2003) with the configuration that Pandora gives as its example of block matching."""
    cones = pathlib.Path(os.environ["BP_DATA"]) / "middlebury2001-2003" / "cones"

    def grey(name):
        with rasterio.open(cones / name) as file:
            return file.read().mean(axis=0).astype(numpy.float32)

    inputs = {side: {"img": save(tmp_path / f"{side}.tif", grey(name))} for side, name in (("left", "imL.png"), ("right", "imR.png"))}
    inputs["left"]["disp"] = [-60, 0]
    truth, is_seen_by_both = grey("groundtruth.png") / 4, (grey("groundtruth.png") > 0) & (grey("nonocc.png") > 0)
    example = {
        "matching_cost": {"matching_cost_method": "zncc", "window_size": 5, "subpix": 4},
        "disparity": {"disparity_method": "wta", "invalid_disparity": "NaN"},
        "refinement": {"refinement_method": "quadratic"},
        "validation": {"validation_method": "cross_checking_accurate"},
    }
    ours = {step: example[step] for step in example if step != "refinement"}
    ours["disparity"] = {"disparity_method": "bpstereo", "invalid_disparity": "NaN"}

    def bad(pipeline):
        """The share of pixels seen by both cameras that have no disparity within 1 px of the truth. Pandora's sign is negative."""
        return 1 - (abs(answer(tmp_path, inputs, pipeline) + truth) <= 1)[is_seen_by_both].mean()

    assert bad(ours) < bad(example) / 2
