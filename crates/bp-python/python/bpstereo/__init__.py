"""Stereo matching by belief propagation: two rectified images in, a disparity map out.

>>> disparity = bpstereo.match(left, right)

`match` matches one pair and `Matcher` many. `StereoBP` has the interface of OpenCV's StereoSGBM. `Calibration` turns
disparities into depth and points, and `Rectifier` raw images into rectified ones. `read_map`, `write_map` and others read and write the program's file formats.
"""

from ._bpstereo import (
    BackendUnavailable,
    Calibration,
    DeviceError,
    Matcher,
    PairWarning,
    Rectifier,
    __version__,
    devices,
    match,
    read_image,
    read_map,
    write_map,
    write_picture,
    write_points,
)
from .opencv import StereoBP
from .options import Options

__all__ = [
    "BackendUnavailable",
    "Calibration",
    "DeviceError",
    "Matcher",
    "Options",
    "PairWarning",
    "Rectifier",
    "StereoBP",
    "__version__",
    "devices",
    "match",
    "read_image",
    "read_map",
    "write_map",
    "write_picture",
    "write_points",
]
