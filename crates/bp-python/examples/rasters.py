#!/usr/bin/env python3
"""Matches rasters that are larger than memory (pip install './crates/bp-python[dask]' rioxarray zarr).

    python rasters.py LEFT RIGHT LABELS DISPARITY.tif|DISPARITY.zarr [BLOCK]

Reads and writes whatever GDAL and xarray do: GeoTIFF and Zarr here. A .tif is Cloud-optimised. The map keeps the left raster's
georeference. Blocks have 1024 pixels a side unless told otherwise.
"""
import pathlib
import sys
import tempfile
import threading

import bpstereo.dask
import numpy
import rasterio.shutil
import rioxarray
import xarray


def opened(path, block):
    """The first band, in blocks that are read when they are needed."""
    if path.endswith(".zarr"):
        return next(iter(xarray.open_zarr(path).data_vars.values())).chunk({"y": block, "x": block})
    return rioxarray.open_rasterio(path, chunks={"y": block, "x": block}).isel(band=0, drop=True)


def main():
    if len(sys.argv) not in (5, 6):
        sys.exit(__doc__)
    block = int(sys.argv[5]) if len(sys.argv) == 6 else 1024
    left, right = (opened(path, block) for path in sys.argv[1:3])
    disparity = left.copy(data=bpstereo.dask.match(left.data, right.data, labels=int(sys.argv[3])))
    # Type and chunks of the left raster are not those of the map.
    disparity = disparity.rename("disparity").drop_encoding()
    output = sys.argv[4]
    if output.endswith(".zarr"):
        disparity.chunk({"y": block, "x": block}).to_dataset().to_zarr(output, mode="w")
        return
    # A Cloud-optimised file can only be made from a finished one: blocks are written to a plain file first.
    with tempfile.TemporaryDirectory(dir=pathlib.Path(output).parent) as folder:
        plain = f"{folder}/plain.tif"
        disparity.rio.write_nodata(numpy.nan).rio.to_raster(plain, tiled=True, lock=threading.Lock(), compress="deflate")
        rasterio.shutil.copy(plain, output, driver="COG", compress="deflate")


main()
