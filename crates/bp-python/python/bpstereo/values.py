"""Images whose values have any range, as satellites send them."""

from __future__ import annotations

from typing import Any

import numpy

#: Darker and brighter values than those of this share of all pixels, in percent, become black and white.
CLIPPED = 0.5

Array = numpy.ndarray[Any, Any]


def stretched(*images: Array) -> list[Array]:
    """Values of any range as float32 from 0 to 1, by the same scale for all images; black where a value is NaN.

    >>> [image] = stretched(numpy.float32([[300, 700], [500, numpy.nan]]))
    >>> image.round(1).tolist()
    [[0.0, 1.0], [0.5, 0.0]]
    """
    floats = [numpy.asarray(image, numpy.float32) for image in images]
    known = numpy.concatenate([image[numpy.isfinite(image)] for image in floats])
    low, high = numpy.percentile(known, [CLIPPED, 100 - CLIPPED]) if known.size else (0, 1)
    scale = 1 / max(high - low, numpy.finfo(numpy.float32).tiny)
    return [numpy.nan_to_num(numpy.clip((image - low) * scale, 0, 1)).astype(numpy.float32) for image in floats]
