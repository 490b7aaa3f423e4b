"""Pairs larger than memory, and clusters: dask arrays in, a dask array out.

Each block is matched with a halo around it, and joined with its neighbours along a border where their maps agree, as the
library does with its tiles. A block extends further left by the largest disparity. The answer is close to that of the whole
image but not the same; the project's page on big images says how close. Which surfaces are too small for the uniqueness
check depends on the size of a block, so the left border may be filled from others.
"""

from __future__ import annotations

from typing import Any

import dask.array
import numpy
from dask.array import overlap

from ._bpstereo import Matcher, _around, _border


_Map = numpy.ndarray[Any, Any]

#: What `map_blocks` is told of maps.
_MAP: dict[str, Any] = {"dtype": numpy.float32, "meta": numpy.empty((0, 0), numpy.float32)}


def match(
    left: dask.array.Array, right: dask.array.Array, *, labels: int, min_disparity: int = 0, **options: Any
) -> dask.array.Array:
    """The disparity map of a rectified pair: a lazy float32 array [height][width] in pixels, NaN where it is unknown.

    Both images are [height][width] or [height][width][3] of uint8 or uint16. The answer's blocks begin where tiles may, at
    multiples of up to 128 columns and 64 rows, and are near the size of theirs. The options are those of `Matcher`, except
    that `align` is "off": each block by itself would measure another alignment.

    >>> import dask.array
    >>> chunked = [dask.array.from_array(image, chunks=(64, 128)) for image in (left, right)]
    >>> disparity = bpstereo.dask.match(*chunked, labels=16).compute()
    >>> float(numpy.nanmedian(disparity[:, 16:]).round())
    3.0
    """
    images, options, depth, shared = _extended(left, right, labels, min_disparity, options)
    dropped = {"drop_axis": 2} if left.ndim == 3 else {}
    maps = dask.array.map_blocks(_matched, *images, options=options, **_MAP, **dropped)
    for axis in (1, 0):
        maps = _joined(maps, axis, depth[axis], shared)
    return maps


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
    images, options, _, _ = _extended(left, right, labels, min_disparity, options)
    largest = tuple(max(sizes) for sizes in images[0].chunks)
    blank = [numpy.zeros(largest, image.dtype) for image in images]
    # Beside the library, the worker holds the two blocks and the map, and copies the map where it is joined.
    arrays = sum(image.nbytes for image in blank) + 2 * 4 * largest[0] * largest[1]
    return arrays + Matcher(**({"threads": 1} | options)).peak_bytes(*blank)


def _extended(
    left: dask.array.Array, right: dask.array.Array, labels: int, min_disparity: int, options: dict[str, Any]
) -> tuple[list[dask.array.Array], dict[str, Any], dict[int, Any], int]:
    """The images in blocks with halos, the options of each match, the halos, and how much of them blocks may share out.

    Wrong options are told now, not by a worker.
    """
    if left.shape != right.shape:
        raise ValueError(f"the images differ in shape: {left.shape} and {right.shape}")
    if left.dtype.kind != "u" or right.dtype.kind != "u":
        raise TypeError("uint8 or uint16 is needed: each block of floats by itself would find another scale")
    if options.get("stretch"):
        raise ValueError("`stretch`: each block by itself would find another scale")
    options = {"align": "off"} | options | {"labels": labels, "min_disparity": min_disparity}
    Matcher(**options)
    columns, rows, (across, down), shared = _around(**options)
    chunks = _chunks(left.chunks[0], down, rows), _chunks(left.chunks[1], across, max(columns))
    # An axis with one block needs no halo.
    depth = {0: (rows, rows) if len(chunks[0]) > 1 else 0, 1: tuple(columns) if len(chunks[1]) > 1 else 0}
    whole = chunks + ((left.shape[2],) if left.ndim == 3 else ())
    images = [image.rechunk(whole) for image in (left, right)]
    images = [overlap.overlap(image, depth=depth, boundary="none", allow_rechunk=False) for image in images]
    return images, options, depth, shared


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


def _joined(maps: dask.array.Array, axis: int, depth: Any, shared: int) -> dask.array.Array:
    """Maps of blocks with halos along an axis, without them: where two meet, each keeps one side of a border."""
    count = maps.numblocks[axis]
    if count == 1:
        return maps
    before, after = depth
    kept = tuple(size - before * (i > 0) - after * (i < count - 1) for i, size in enumerate(maps.chunks[axis]))
    shared = min(shared, *(size // 2 for size in kept))

    def strips(blocks: dask.array.Array, middle: int) -> dask.array.Array:
        """Of each block, what lies on both sides of the end of what it keeps."""
        chunks = tuple((2 * shared,) * (count - 1) if i == axis else sizes for i, sizes in enumerate(blocks.chunks))
        return dask.array.map_blocks(_strip, blocks, axis=axis, start=middle - shared, stop=middle + shared, chunks=chunks, **_MAP)

    def of(blocks: slice) -> dask.array.Array:
        return maps.blocks[(slice(None),) * axis + (blocks,)]

    # The first block has none before it, the last none behind it. Dask would leave out blocks without a pixel.
    chunks = tuple((1,) if i == axis else sizes for i, sizes in enumerate(maps.chunks))
    none = dask.array.zeros(tuple(map(sum, chunks)), chunks=chunks, dtype=numpy.float32)
    previous = dask.array.concatenate([none, strips(of(slice(None, -1)), -after)], axis)
    following = dask.array.concatenate([strips(of(slice(1, None)), before), none], axis)
    chunks = tuple(kept if i == axis else sizes for i, sizes in enumerate(maps.chunks))
    return dask.array.map_blocks(_kept, maps, previous, following, axis=axis, depth=depth, chunks=chunks, **_MAP)


def _strip(block: _Map, axis: int, start: int, stop: int) -> _Map:
    return block[(slice(None),) * axis + (slice(start, stop),)]


def _kept(own: _Map, previous: _Map, following: _Map, axis: int, depth: tuple[int, int]) -> _Map:
    """What a block keeps, up to its borders with the blocks before and behind it, and what those keep beyond them."""
    # A worker receives arrays at any address.
    own, previous, following = (numpy.moveaxis(numpy.require(map, requirements="A"), axis, 1) for map in (own, previous, following))
    has_previous, has_following = (map.shape[1] > 1 for map in (previous, following))
    shared = max(previous.shape[1], following.shape[1]) // 2
    start = depth[0] if has_previous else 0
    stop = own.shape[1] - (depth[1] if has_following else 0)
    kept, place = own[:, start:stop].copy(), numpy.arange(shared)
    if has_previous:
        border = _border(previous, own[:, start - shared : start + shared])[:, None]
        kept[:, :shared] = numpy.where(place + shared < border, previous[:, shared:], kept[:, :shared])
    if has_following:
        border = _border(own[:, stop - shared : stop + shared], following)[:, None]
        kept[:, -shared:] = numpy.where(place < border, kept[:, -shared:], following[:, :shared])
    return numpy.ascontiguousarray(numpy.moveaxis(kept, 1, axis))
