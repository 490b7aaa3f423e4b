"""Pairs larger than memory, and clusters: dask arrays in, a dask array out.

Each block is matched with a halo around it, as the library does with its tiles. A block extends further left by the
largest disparity. The answer is close to that of the whole image but not the same; the project's page on big images says
how close.
"""

from __future__ import annotations

import math
from typing import Any

import dask.array
import numpy
from dask.array import overlap

from ._bpstereo import Matcher

#: Columns and rows of the halo, those of the library's tiles.
HALO_COLUMNS, HALO_ROWS = 96, 64

#: Blocks that begin at multiples of these have the patches of label sets where the whole image has them.
PATCH_COLUMNS, PATCH_ROWS = 128, 64


def match(
    left: dask.array.Array, right: dask.array.Array, *, labels: int, min_disparity: int = 0, **options: Any
) -> dask.array.Array:
    """The disparity map of a rectified pair: a lazy float32 array [height][width] in pixels, NaN where it is unknown.

    Both images are [height][width] or [height][width][3] of uint8 or uint16. The answer's blocks are multiples of 128
    columns and 64 rows near the size of theirs. The options are those of `Matcher`, except that `align` is "off": each
    block by itself would measure another alignment.

    >>> import dask.array
    >>> chunked = [dask.array.from_array(image, chunks=(64, 128)) for image in (left, right)]
    >>> disparity = bpstereo.dask.match(*chunked, labels=16).compute()
    >>> float(numpy.nanmedian(disparity[:, 16:]).round())
    3.0
    """
    images, options, depth = _extended(left, right, labels, min_disparity, options)
    kind: dict[str, Any] = {"dtype": numpy.float32, "meta": numpy.empty((0, 0), numpy.float32)}
    dropped = {"drop_axis": 2} if left.ndim == 3 else {}
    matched = dask.array.map_blocks(_matched, *images, options=options, **kind, **dropped)
    return overlap.trim_overlap(matched, depth=depth, boundary="none")


def peak_bytes(
    left: dask.array.Array, right: dask.array.Array, *, labels: int, min_disparity: int = 0, **options: Any
) -> int:
    """The most bytes that a worker is predicted to hold while it matches one block, beside Python and its packages.

    It takes what `match` takes, and computes nothing but this. The option `max_memory` of `match` holds each block to a
    limit.

    >>> import dask.array
    >>> image = dask.array.zeros((4096, 4096), chunks=1024, dtype="uint8")
    >>> 50_000_000 < bpstereo.dask.peak_bytes(image, image, labels=64) < 500_000_000
    True
    """
    images, options, _ = _extended(left, right, labels, min_disparity, options)
    largest = tuple(max(sizes) for sizes in images[0].chunks)
    blank = [numpy.zeros(largest, image.dtype) for image in images]
    # Beside the library, the worker holds the two blocks and the map.
    arrays = sum(image.nbytes for image in blank) + 4 * largest[0] * largest[1]
    return arrays + Matcher(**({"threads": 1} | options)).peak_bytes(*blank)


def _extended(
    left: dask.array.Array, right: dask.array.Array, labels: int, min_disparity: int, options: dict[str, Any]
) -> tuple[list[dask.array.Array], dict[str, Any], dict[int, Any]]:
    """The images in blocks with halos, the options of each match, and the halos. Wrong options are told now, not by a worker."""
    if left.shape != right.shape:
        raise ValueError(f"the images differ in shape: {left.shape} and {right.shape}")
    if left.dtype.kind != "u" or right.dtype.kind != "u":
        raise TypeError("uint8 or uint16 is needed: each block of floats by itself would find another scale")
    if isinstance(labels, bool) or not isinstance(labels, (int, numpy.integer)):
        raise ValueError("`labels` must be a number: each block by itself would find other labels")
    if options.get("stretch"):
        raise ValueError("`stretch`: each block by itself would find another scale")
    options = {"align": "off"} | options | {"labels": int(labels), "min_disparity": int(min_disparity)}
    Matcher(**options)
    before, after = halo(labels, min_disparity)
    chunks = _chunks(left.chunks[0], PATCH_ROWS, HALO_ROWS), _chunks(left.chunks[1], PATCH_COLUMNS, max(before, after))
    # An axis with one block needs no halo.
    depth = {0: (HALO_ROWS, HALO_ROWS) if len(chunks[0]) > 1 else 0, 1: (before, after) if len(chunks[1]) > 1 else 0}
    whole = chunks + ((left.shape[2],) if left.ndim == 3 else ())
    images = [image.rechunk(whole) for image in (left, right)]
    return [overlap.overlap(image, depth=depth, boundary="none", allow_rechunk=False) for image in images], options, depth


def halo(labels: int, min_disparity: int = 0) -> tuple[int, int]:
    """The columns that a block needs on its left and right: those of the halo, and those that its disparities reach.

    >>> bpstereo.dask.halo(128)
    (256, 128)
    """
    last = min_disparity + labels - 1
    reach = max(0, last), max(0, -min_disparity)
    before, after = (PATCH_COLUMNS * math.ceil((HALO_COLUMNS + columns) / PATCH_COLUMNS) for columns in reach)
    return before, after


def _chunks(sizes: tuple[int, ...], step: int, least: int) -> tuple[int, ...]:
    """Sizes of blocks near the largest of these, that begin at multiples of `step` and have at least `least`."""
    total, size = sum(sizes), max(least, step * max(1, round(max(sizes) / step)))
    count = total // size
    if count == 0:
        return (total,)
    rest = total - count * size
    if rest >= least:
        return (size,) * count + (rest,)
    return (size,) * (count - 1) + (size + rest,)


def _matched(left: numpy.ndarray[Any, Any], right: numpy.ndarray[Any, Any], options: dict[str, Any]) -> numpy.ndarray[Any, Any]:
    """The map of a block with its halo. Workers have threads of their own, so a match uses one."""
    if left.size == 0:
        return numpy.empty(left.shape[:2], numpy.float32)
    return Matcher(**({"threads": 1} | options)).compute(left, right)
