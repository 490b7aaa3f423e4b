"""Blocks of dask arrays: near the whole image's answer, and complete even if a worker dies."""
import os
import signal
import subprocess
import sys
import threading
import time

import bpstereo
import numpy
import pytest

dask_array = pytest.importorskip("dask.array")
import bpstereo.dask  # noqa: E402
from conftest import ROOT  # noqa: E402


def scene(height, width, most):
    """Planes at several depths: a pair and its true disparities."""
    rng = numpy.random.default_rng(5)
    texture = rng.integers(0, 256, (height, width + most), dtype=numpy.uint8)
    truth = numpy.full((height, width), 4)
    for index in range(12):
        y, x = rng.integers(0, height), rng.integers(0, width)
        truth[y : y + height // 3, x : x + width // 4] = rng.integers(4, most)
    right = texture[:, :width].copy()
    left = numpy.take_along_axis(right, numpy.clip(numpy.arange(width) - truth, 0, None), axis=1)
    return left, right, truth


def blocks(*images, chunks):
    return [dask_array.from_array(image, chunks=chunks) for image in images]


def test_blocks_are_near_the_whole_image():
    left, right, truth = scene(400, 900, 40)
    whole = bpstereo.match(left, right, labels=48, align="off")
    lazy = bpstereo.dask.match(*blocks(left, right, chunks=(128, 256)), labels=48)
    assert lazy.shape == left.shape and lazy.dtype == numpy.float32 and lazy.npartitions > 4
    found = lazy.compute(scheduler="threads")
    # The means behind the fractions begin at the block's border, which rounds differently.
    assert (abs(found - whole) > 0.1).mean() < 0.001
    inside = numpy.s_[:, 48:]
    wrong = [(abs(map - truth)[inside] > 1).mean() for map in (found, whole)]
    assert wrong[0] < wrong[1] + 0.005, wrong


def test_any_chunks_and_colours_do():
    left, right, _ = scene(150, 500, 20)
    expected = bpstereo.match(left, right, labels=24, min_disparity=-2, align="off")
    for chunks in [(150, 500), (7, 33), (150, 100), (64, 499)]:
        found = bpstereo.dask.match(*blocks(left, right, chunks=chunks), labels=24, min_disparity=-2).compute()
        assert (abs(found - expected) > 0.5).mean() < 0.02, chunks
    coloured = blocks(numpy.dstack([left] * 3), numpy.dstack([right] * 3), chunks=(64, 256, 3))
    assert (abs(bpstereo.dask.match(*coloured, labels=24, min_disparity=-2).compute() - expected) > 0.5).mean() < 0.02


def test_a_block_takes_what_is_predicted():
    left, right, _ = scene(600, 1200, 40)
    images = blocks(left, right, chunks=(128, 256))
    predicted = bpstereo.dask.peak_bytes(*images, labels=48)
    # Of smaller blocks a worker holds less, down to the library's own part.
    assert 25 << 20 < predicted < bpstereo.dask.peak_bytes(*blocks(left, right, chunks=(600, 1200)), labels=48)
    found = bpstereo.dask.match(*images, labels=48, max_memory=predicted).compute(scheduler="threads", num_workers=1)
    assert numpy.isfinite(found).any()
    with pytest.raises(MemoryError):
        bpstereo.dask.peak_bytes(*images, labels=48, max_memory=26 << 20)


def test_what_cannot_work_is_told_at_once():
    left, right, _ = scene(64, 128, 8)
    images = blocks(left, right, chunks=(64, 128))
    for wrong in [{"labels": "auto"}, {"labels": 16, "labls": 3}, {"labels": 16, "median": 4}]:
        with pytest.raises(ValueError):
            bpstereo.dask.match(*images, **wrong)
    with pytest.raises(ValueError, match="scale"):
        bpstereo.dask.match(*images, labels=16, stretch=True)
    with pytest.raises(ValueError, match="shape"):
        bpstereo.dask.match(images[0], images[1][:10], labels=16)


def test_a_worker_that_dies_loses_nothing():
    distributed = pytest.importorskip("distributed")
    left, right, _ = scene(600, 1200, 40)
    lazy = bpstereo.dask.match(*blocks(left, right, chunks=(64, 256)), labels=48)
    expected = lazy.compute(scheduler="synchronous")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            victim = next(iter(client.run(os.getpid).values()))
            killer = threading.Timer(0.5, os.kill, (victim, signal.SIGKILL))
            killer.start()
            begin = time.monotonic()
            found = client.compute(lazy, retries=3).result(timeout=120)
            assert time.monotonic() - begin > 0.5, "the worker died too late"
            killer.join()
    assert numpy.array_equal(found, expected, equal_nan=True)


@pytest.mark.filterwarnings("ignore")
def test_the_example_reads_and_writes_geotiff_and_zarr(tmp_path):
    rasterio, xarray = pytest.importorskip("rasterio"), pytest.importorskip("xarray")
    pytest.importorskip("rioxarray")
    pytest.importorskip("zarr")
    left, right, _ = scene(700, 900, 40)
    where = {"crs": "EPSG:32631", "transform": rasterio.transform.from_origin(500_000, 4_800_000, 0.5, 0.5)}
    for name, image in (("left", left), ("right", right)):
        with rasterio.open(tmp_path / f"{name}.tif", "w", driver="GTiff", height=700, width=900, count=1, dtype="uint8", **where) as file:
            file.write(image, 1)
        xarray.Dataset({"im": (("y", "x"), image)}).to_zarr(tmp_path / f"{name}.zarr")
    expected = bpstereo.dask.match(*blocks(left, right, chunks=(256, 256)), labels=48).compute()
    script = ROOT / "crates" / "bp-python" / "examples" / "rasters.py"
    for ending in ("tif", "zarr"):
        files = [tmp_path / f"{name}.{ending}" for name in ("left", "right", "map")]
        subprocess.run([sys.executable, script, *files[:2], "48", files[2], "256"], check=True)
    with rasterio.open(tmp_path / "map.tif") as file:
        assert numpy.array_equal(file.read(1), expected, equal_nan=True)
        assert file.crs == where["crs"] and file.transform == where["transform"] and numpy.isnan(file.nodata)
        assert file.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG" and file.overviews(1)
    stored = xarray.open_zarr(tmp_path / "map.zarr")["disparity"]
    assert numpy.array_equal(stored.values, expected, equal_nan=True) and stored.chunks is not None
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".tif"] * 3 + [".zarr"] * 3
