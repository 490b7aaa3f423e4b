"""The command `bp-mgm`: takes the place of `mgm` and `mgm_multi`, the matchers that s2p and the Ames Stereo Pipeline call.

It has their command line, image files, sign and environment variables:

    bp-mgm -r -40 -R 12 [options] left.tif right.tif disparity.tif

The right column is the left one plus the disparity. Images have any type and range of values. Disparities are float32, NaN where
they are unknown or where the left image has no value. Options that belong to semi-global matching are read and have no effect.
"""

from __future__ import annotations

import argparse
import math
import os
import pathlib
import sys
import tempfile
import warnings
from collections.abc import Sequence
from typing import Any

import numpy
import rasterio  # type: ignore[import-untyped]
from rasterio.errors import NotGeoreferencedWarning, RasterioError  # type: ignore[import-untyped]

from ._bpstereo import Matcher, __version__

Array = numpy.ndarray[Any, Any]

#: Options of mgm with a value that have no counterpart here.
WITHOUT_COUNTERPART = (
    "-O", "-P1", "-P2", "-S", "-p", "-s", "-t", "-truncDist", "-a", "-aP1", "-aP2", "-aThresh", "-wl", "-wr", "-i", "-nolr",
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Matches a pair. Returns the exit code: 0, 2 for wrong arguments, 1 for everything else."""
    args = _parser().parse_args(arguments)
    try:
        _match(args)
    except (RasterioError, OSError, ValueError, MemoryError, RuntimeError) as error:
        print(f"bp-mgm: {error}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    description, _, details = (__doc__ or "").partition("\n\n")
    parser = argparse.ArgumentParser("bp-mgm", description=description, epilog=details, allow_abbrev=False,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--version", action="version", version=__version__)
    parser.add_argument("-r", type=float, required=True, metavar="MIN", dest="low", help="smallest disparity")
    parser.add_argument("-R", type=float, required=True, metavar="MAX", dest="high", help="largest disparity")
    parser.add_argument("-confidence_consensusL", metavar="FILE", dest="confidence", help="write the confidence too, 0 to 1")
    for option in WITHOUT_COUNTERPART:
        parser.add_argument(option, help=argparse.SUPPRESS)
    for name in ("left", "right", "disparity"):
        parser.add_argument(name)
    return parser


def options(environment: dict[str, str]) -> dict[str, Any]:
    """The options of `Matcher` that mgm's environment variables mean. Like mgm, checks left against right unless told not to.

    >>> options({"MEDIAN": "1", "REMOVESMALLCC": "25", "OMP_NUM_THREADS": "4"})
    {'check': True, 'fill': False, 'median': 3, 'speckle': 25, 'threads': 4}
    >>> options({"TESTLRRL": "0"})
    {'unique': False}
    """
    def number(name: str, default: int = 0) -> int:
        value = environment.get(name, "").strip() or str(default)
        try:
            return int(float(value))
        except ValueError:
            raise ValueError(f"{name}={value}: a number is needed") from None
    meant: dict[str, Any] = {}
    if number("TESTLRRL", default=1):
        meant |= {"check": True, "fill": False}
    else:
        meant["unique"] = False
    if number("MEDIAN"):
        meant["median"] = 2 * min(number("MEDIAN"), 3) + 1
    if number("REMOVESMALLCC") > 0:
        meant |= {"speckle": number("REMOVESMALLCC"), "fill": False}
    if number("OMP_NUM_THREADS") > 0:
        meant["threads"] = number("OMP_NUM_THREADS")
    return meant


def _match(args: argparse.Namespace) -> None:
    if not math.isfinite(args.low) or not math.isfinite(args.high) or args.low > args.high:
        raise ValueError(f"disparities from {args.low:g} to {args.high:g}: the smallest comes first (-r), then the largest (-R)")
    low, high = math.floor(args.low), math.ceil(args.high)
    left, right = _read(args.left), _read(args.right)
    height = max(len(left), len(right))
    width = max(left.shape[1], right.shape[1])
    # Ours is left minus right. The rows of these pairs are right already.
    matcher = Matcher(labels=high - low + 1, min_disparity=-high, align="off", stretch=True, confidence=bool(args.confidence),
                      **options(dict(os.environ)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = matcher.compute(*(_padded(image, height, width) for image in (left, right)))
    _write(args.disparity, -found, left)
    if matcher.confidence is not None:
        _write(args.confidence, matcher.confidence, left)


def _read(path: str) -> Array:
    """The first band [height][width], NaN where the file has no value."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        with rasterio.open(path) as file:
            return numpy.asarray(file.read(1, masked=True, out_dtype="float32").filled(numpy.nan))


def _padded(image: Array, height: int, width: int) -> Array:
    """The image enlarged to the right and below, without values there."""
    rows, columns = height - image.shape[0], width - image.shape[1]
    return numpy.pad(image, ((0, rows), (0, columns)), constant_values=numpy.nan)


def _write(path: str, values: Array, left: Array) -> None:
    """Writes the values where the left image has some, and NaN elsewhere: a file whole or not at all."""
    values = numpy.where(numpy.isfinite(left), values[: left.shape[0], : left.shape[1]], numpy.nan)
    target = pathlib.Path(path)
    shape = {"height": values.shape[0], "width": values.shape[1], "count": 1, "dtype": "float32"}
    with tempfile.TemporaryDirectory(prefix=".bp-", dir=target.parent) as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        with rasterio.open(pathlib.Path(folder) / "map.tif", "w", driver="GTiff", **shape) as file:
            file.write(values.astype(numpy.float32), 1)
        os.replace(pathlib.Path(folder) / "map.tif", target)
