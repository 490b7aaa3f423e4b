"""The matcher behind the interface of OpenCV's StereoSGBM."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy

from ._bpstereo import Matcher

#: OpenCV's disparities are whole numbers of sixteenths of a pixel.
SIXTEENTHS = 16

#: Parameters of StereoSGBM that have no counterpart here, with OpenCV's defaults.
WITHOUT_COUNTERPART = {
    "blockSize": 3, "P1": 0, "P2": 0, "preFilterCap": 0, "speckleRange": 0, "mode": 0,
}


def _methods(name: str) -> tuple[Callable[[StereoBP], int], Callable[[StereoBP, int], None]]:
    """The methods that return and set a parameter of StereoSGBM."""
    effect = "It has no effect." if name in WITHOUT_COUNTERPART else "The next pair is matched with it."

    def getter(self: StereoBP) -> int:
        return self._values[name]

    def setter(self: StereoBP, value: int) -> None:
        self._set({name: value})

    getter.__doc__, setter.__doc__ = f"OpenCV's parameter {name}.", f"Sets OpenCV's parameter {name}. {effect}"
    return getter, setter


class StereoBP:
    """Matches pairs as a drop-in for `cv2.StereoSGBM`.

    In a script for StereoSGBM, change `cv2.StereoSGBM_create(...)` or `cv2.StereoSGBM.create(...)` to
    `bpstereo.StereoBP.create(...)`.

    >>> matcher = bpstereo.StereoBP.create(minDisparity=0, numDisparities=16)
    >>> disparity = matcher.compute(left, right)
    >>> disparity.dtype, int(numpy.median(disparity[:, 16:]) / 16)
    (dtype('int16'), 3)
    """

    def __init__(self, **options: Any) -> None:
        """Use `create`."""
        self._options, self._values, self._told = options, WITHOUT_COUNTERPART, set[str]()
        self._matcher: Matcher | None = None

    @staticmethod
    def create(
        minDisparity: int = 0, numDisparities: int = 16, blockSize: int = 3, P1: int = 0, P2: int = 0,
        disp12MaxDiff: int = 0, preFilterCap: int = 0, uniquenessRatio: int = 0, speckleWindowSize: int = 0,
        speckleRange: int = 0, mode: int = 0, **options: Any,
    ) -> "StereoBP":
        """A matcher with OpenCV's parameters. Further keywords are options of `Matcher`.

        minDisparity and numDisparities give the labels. A disp12MaxDiff above 0 turns the left-right check on,
        uniquenessRatio the uniqueness check, and speckleWindowSize the speckle filter; what they remove stays unknown, as in
        OpenCV. The other parameters have no counterpart: a warning says so if one is given another value than OpenCV's
        default.
        """
        values = dict(
            minDisparity=minDisparity, numDisparities=numDisparities, blockSize=blockSize, P1=P1, P2=P2,
            disp12MaxDiff=disp12MaxDiff, preFilterCap=preFilterCap, uniquenessRatio=uniquenessRatio,
            speckleWindowSize=speckleWindowSize, speckleRange=speckleRange, mode=mode,
        )
        made = StereoBP(**options)
        made._set(values)
        made._matcher = made._opened()
        return made

    getMinDisparity, setMinDisparity = _methods("minDisparity")
    getNumDisparities, setNumDisparities = _methods("numDisparities")
    getBlockSize, setBlockSize = _methods("blockSize")
    getP1, setP1 = _methods("P1")
    getP2, setP2 = _methods("P2")
    getDisp12MaxDiff, setDisp12MaxDiff = _methods("disp12MaxDiff")
    getPreFilterCap, setPreFilterCap = _methods("preFilterCap")
    getUniquenessRatio, setUniquenessRatio = _methods("uniquenessRatio")
    getSpeckleWindowSize, setSpeckleWindowSize = _methods("speckleWindowSize")
    getSpeckleRange, setSpeckleRange = _methods("speckleRange")
    getMode, setMode = _methods("mode")

    def compute(
        self, left: numpy.ndarray[Any, Any], right: numpy.ndarray[Any, Any],
        disparity: numpy.ndarray[Any, Any] | None = None,
    ) -> numpy.ndarray[Any, Any]:
        """The disparity map as OpenCV has it: int16 [height][width], 16 times the disparity in pixels.

        Unknown pixels are (minDisparity - 1) * 16. Images are uint8, grey or blue, green, red.
        """
        self._matcher = self._matcher or self._opened()
        found = self._matcher.compute(_as_rgb(left), _as_rgb(right))
        unknown = self._values["minDisparity"] - 1
        stored = numpy.round(numpy.nan_to_num(found, nan=unknown) * SIXTEENTHS).astype(numpy.int16)
        if disparity is None:
            return stored
        if disparity.dtype != numpy.int16 or disparity.shape != stored.shape:
            raise ValueError(f"disparity is {disparity.dtype} {disparity.shape}; int16 {stored.shape} is needed")
        disparity[...] = stored
        return disparity

    def _set(self, values: dict[str, int]) -> None:
        """Sets parameters. The first time that one has no effect, a warning says so."""
        unused = [name for name, value in values.items() if value != WITHOUT_COUNTERPART.get(name, value)]
        if not self._told.issuperset(unused):
            # The third frame is the script's, that called `create` or a setter.
            warnings.warn(f"without effect in StereoBP: {', '.join(unused)}", stacklevel=3)
        self._told.update(unused)
        values = self._values | {name: int(value) for name, value in values.items()}
        if values != self._values:
            # Opened by the next pair: parameters that are set one after another need to fit only then.
            self._values, self._matcher = values, None

    def _opened(self) -> Matcher:
        """A matcher with the parameters."""
        first, labels = self._values["minDisparity"], self._values["numDisparities"]
        last = first + labels - 1
        if not -2047 <= first or not last <= 2047:
            raise ValueError(f"disparities from {first} to {last} do not fit into int16 sixteenths: -2047 to 2047 do")
        meant: dict[str, Any] = {"fill": False, "unique": self._values["uniquenessRatio"] > 0}
        if self._values["disp12MaxDiff"] > 0:
            meant["check"] = True
        if self._values["speckleWindowSize"] > 0:
            meant["speckle"] = self._values["speckleWindowSize"]
        return Matcher(labels=labels, min_disparity=first, **(meant | self._options))


def _as_rgb(image: numpy.ndarray[Any, Any]) -> numpy.ndarray[Any, Any]:
    """OpenCV's order of colours reversed."""
    return image[..., ::-1] if numpy.ndim(image) == 3 else image
