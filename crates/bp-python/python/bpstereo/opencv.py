"""The matcher behind the interface of OpenCV's StereoSGBM."""

from __future__ import annotations

import warnings
from typing import Any

import numpy

from ._bpstereo import Matcher

#: OpenCV's disparities are whole numbers of sixteenths of a pixel.
SIXTEENTHS = 16

#: Parameters of StereoSGBM that have no counterpart here, with OpenCV's defaults.
WITHOUT_COUNTERPART = {
    "blockSize": 3, "P1": 0, "P2": 0, "preFilterCap": 0, "uniquenessRatio": 0, "speckleRange": 0, "mode": 0,
}


class StereoBP:
    """Matches pairs as a drop-in for `cv2.StereoSGBM`.

    In a script that creates a StereoSGBM and calls `compute`, change `cv2.StereoSGBM_create(...)` or
    `cv2.StereoSGBM.create(...)` to `bpstereo.StereoBP.create(...)`.

    >>> matcher = bpstereo.StereoBP.create(minDisparity=0, numDisparities=16)
    >>> disparity = matcher.compute(left, right)
    >>> disparity.dtype, int(numpy.median(disparity[:, 16:]) / 16)
    (dtype('int16'), 3)
    """

    def __init__(self, minDisparity: int, numDisparities: int, **options: Any) -> None:
        """Use `create`."""
        self._first, self._labels = int(minDisparity), int(numDisparities)
        last = self._first + self._labels - 1
        if not -2047 <= self._first or not last <= 2047:
            raise ValueError(f"disparities from {self._first} to {last} do not fit into int16 sixteenths: -2047 to 2047 do")
        self._matcher = Matcher(labels=self._labels, min_disparity=self._first, **options)

    @staticmethod
    def create(
        minDisparity: int = 0, numDisparities: int = 16, blockSize: int = 3, P1: int = 0, P2: int = 0,
        disp12MaxDiff: int = 0, preFilterCap: int = 0, uniquenessRatio: int = 0, speckleWindowSize: int = 0,
        speckleRange: int = 0, mode: int = 0, **options: Any,
    ) -> "StereoBP":
        """A matcher with OpenCV's parameters. Further keywords are options of `Matcher`.

        minDisparity and numDisparities give the labels. A disp12MaxDiff above 0 turns the left-right check on, and
        speckleWindowSize the speckle filter; what they remove stays unknown, as in OpenCV. The other parameters have no
        counterpart: a warning says so if one is given another value than OpenCV's default.
        """
        given = dict(blockSize=blockSize, P1=P1, P2=P2, preFilterCap=preFilterCap, uniquenessRatio=uniquenessRatio,
                     speckleRange=speckleRange, mode=mode)
        unused = [name for name, value in given.items() if value != WITHOUT_COUNTERPART[name]]
        if unused:
            warnings.warn(f"without effect in StereoBP: {', '.join(unused)}", stacklevel=2)
        if disp12MaxDiff > 0:
            options.setdefault("check", True)
        if speckleWindowSize > 0:
            options.setdefault("speckle", speckleWindowSize)
        options.setdefault("fill", False)
        return StereoBP(minDisparity, numDisparities, **options)

    def compute(
        self, left: numpy.ndarray[Any, Any], right: numpy.ndarray[Any, Any],
        disparity: numpy.ndarray[Any, Any] | None = None,
    ) -> numpy.ndarray[Any, Any]:
        """The disparity map as OpenCV has it: int16 [height][width], 16 times the disparity in pixels.

        Unknown pixels are (minDisparity - 1) * 16. Images are uint8, grey or blue, green, red.
        """
        found = self._matcher.compute(_as_rgb(left), _as_rgb(right))
        stored = numpy.round(numpy.nan_to_num(found, nan=self._first - 1) * SIXTEENTHS).astype(numpy.int16)
        if disparity is None:
            return stored
        if disparity.dtype != numpy.int16 or disparity.shape != stored.shape:
            raise ValueError(f"disparity is {disparity.dtype} {disparity.shape}; int16 {stored.shape} is needed")
        disparity[...] = stored
        return disparity

    def getMinDisparity(self) -> int:
        """The disparity of the first label."""
        return self._first

    def getNumDisparities(self) -> int:
        """The number of labels."""
        return self._labels


def _as_rgb(image: numpy.ndarray[Any, Any]) -> numpy.ndarray[Any, Any]:
    """OpenCV's order of colours reversed."""
    return image[..., ::-1] if numpy.ndim(image) == 3 else image
