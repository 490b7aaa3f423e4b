"""A plug-in for Pandora, the stereo framework of CNES and the matcher of CARS: the disparity step "bpstereo".

In a pipeline it takes the place of "wta". It matches the images themselves. The cost volume says which disparities each
pixel may have.

    "disparity": {"disparity_method": "bpstereo", "invalid_disparity": "NaN", "options": {"quality": "best"}}

Leave the refinement step out: these disparities have fractions already.
"""

from __future__ import annotations

from typing import Any

import numpy
import xarray
from pandora.disparity import disparity

from ._bpstereo import Matcher


@disparity.AbstractDisparity.register_subclass("bpstereo")
class BeliefPropagation(disparity.AbstractDisparity):
    """The disparity step "bpstereo"."""

    def __init__(self, **cfg: Any) -> None:
        full = self.cfg = self.check_conf(**cfg)
        self._options = full["options"]
        invalid = numpy.nan if full["invalid_disparity"] == "NaN" else full["invalid_disparity"]
        self._pandoras_own = disparity.WinnerTakesAll(disparity_method="wta", invalid_disparity=invalid)

    def check_conf(self, **cfg: Any) -> dict[str, Any]:
        """The configuration with defaults. Fails at keys that do not exist."""
        full: dict[str, Any] = {"invalid_disparity": -9999, "options": {}} | cfg
        unknown = set(full) - {"disparity_method", "invalid_disparity", "options"}
        if unknown:
            raise ValueError(f"bpstereo: unknown in the configuration: {', '.join(sorted(unknown))}")
        Matcher(**full["options"])
        return full

    def desc(self) -> None:
        """Describes the method."""
        print("Belief propagation on the images (bpstereo)")

    def to_disp(
        self, cv: xarray.Dataset, img_left: xarray.Dataset | None = None, img_right: xarray.Dataset | None = None
    ) -> xarray.Dataset:
        """The map of the left image. `cv` gets the whole disparities nearest to it, for the steps that follow."""
        if img_left is None or img_right is None:
            raise ValueError("bpstereo needs the images, which this version of Pandora does not pass on")
        steps, allowed = cv.coords["disp"].data, ~numpy.isnan(cv["cost_volume"].data)
        # Masks, intervals, confidences and invalid pixels are Pandora's.
        answer: xarray.Dataset = self._pandoras_own.to_disp(cv, img_left, img_right)
        known = allowed.any(axis=2)
        found = _within(_matched(img_left, img_right, steps, self._options), steps, allowed)
        answer["disparity_map"].data[known] = found[known]
        cv["disp_indices"].data[known] = _nearest(found, steps)[known]
        return answer


def _matched(left: xarray.Dataset, right: xarray.Dataset, steps: numpy.ndarray[Any, Any], options: dict[str, Any]) -> Any:
    """Our map with Pandora's sign: there, the right column is the left one plus the disparity."""
    first, last = int(numpy.floor(steps[0])), int(numpy.ceil(steps[-1]))
    defaults: dict[str, Any] = {"align": "off", "stretch": True}
    meant = defaults | options | {"labels": last - first + 1, "min_disparity": -last}
    return -Matcher(**meant).compute(*(_as_image(side, is_stretched=meant["stretch"]) for side in (left, right)))


def _within(found: Any, steps: numpy.ndarray[Any, Any], allowed: numpy.ndarray[Any, Any]) -> Any:
    """The map within the disparities that each pixel may have; unknown pixels get the middle of them."""
    low, high = steps[allowed.argmax(axis=2)], steps[allowed.shape[2] - 1 - allowed[..., ::-1].argmax(axis=2)]
    return numpy.clip(numpy.where(numpy.isnan(found), (low + high) / 2, found), low, high)


def _nearest(found: Any, steps: numpy.ndarray[Any, Any]) -> Any:
    """For each disparity the nearest of the steps, which ascend."""
    above = numpy.searchsorted(steps, found).clip(1, max(1, len(steps) - 1))
    low, high = steps[above - 1], steps[numpy.minimum(above, len(steps) - 1)]
    return numpy.where(found - low < high - found, low, high)


def _as_image(dataset: xarray.Dataset, is_stretched: bool) -> numpy.ndarray[Any, Any]:
    """The image as float32. Bands come first: red, green and blue, or of fewer bands the first."""
    image = numpy.asarray(dataset["im"].data, numpy.float32)
    if is_stretched and "msk" in dataset:
        # Pandora leaves its number for missing values in the image, which is far from all others.
        image = numpy.where(dataset["msk"].data == dataset.attrs["no_data_mask"], numpy.float32(numpy.nan), image)
    if image.ndim == 2:
        return image
    return numpy.moveaxis(image[:3], 0, 2) if len(image) > 2 else image[0]
