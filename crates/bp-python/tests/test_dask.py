"""Blocks of dask arrays: near the whole image's answer, and complete even if a worker dies."""
import os
import signal
import subprocess
import sys
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
    inside = numpy.s_[:, 48:]
    # Which surfaces are too small for the default check depends on the size of the image, and so what fills the left border.
    assert (abs(found - whole)[inside] > 0.1).mean() < 0.001
    unchecked = {"labels": 48, "unique": False}
    lazy = bpstereo.dask.match(*blocks(left, right, chunks=(128, 256)), **unchecked)
    # The means behind the fractions begin at the block's border, which rounds differently.
    assert (abs(lazy.compute() - bpstereo.match(left, right, align="off", **unchecked)) > 0.1).mean() < 0.001
    wrong = [(abs(map - truth)[inside] > 1).mean() for map in (found, whole)]
    assert wrong[0] < wrong[1] + 0.005, wrong


def test_blocks_are_near_the_librarys_tiles():
    left, right, _ = scene(400, 900, 40)
    # A part without texture, where answers differ most.
    left[100:300, 300:600] = right[100:300, 300:600] = 90
    matcher = bpstereo.Matcher(labels=48, align="off", max_memory=60 << 20, threads=1)
    tiles = matcher.compute(left, right)
    assert matcher.settings["message_updates"] > 0 and matcher.peak_bytes(left, right) <= 60 << 20
    found = bpstereo.dask.match(*blocks(left, right, chunks=(128, 256)), labels=48).compute()
    assert (abs(found - tiles) > 1).mean() < 0.01


@pytest.mark.parametrize("algorithm, rows", [("sweep", 64), ("cfbp", 96)])
def test_a_block_has_the_halo_of_a_tile(algorithm, rows):
    left, right, _ = scene(300, 700, 20)
    images, _, depth, _ = bpstereo.dask._extended(*blocks(left, right, chunks=(128, 256)), 24, -5, {"algorithm": algorithm})
    assert images[0].npartitions > 2 and depth[0] == (rows, rows)
    # 96 columns, and those that disparities from -5 to 18 reach, in multiples of 32.
    assert depth[1] == (128, 128)
    whole = bpstereo.match(left, right, labels=24, min_disparity=-5, align="off", algorithm=algorithm)
    found = bpstereo.dask.match(*blocks(left, right, chunks=(128, 256)), labels=24, min_disparity=-5, algorithm=algorithm)
    assert (abs(found.compute() - whole) > 1).mean() < 0.002


@pytest.mark.parametrize("axis", [0, 1])
def test_blocks_are_joined_where_they_agree(axis):
    """Three blocks that keep 40 lines each have halos of 24, and share out 16 on both sides of a border."""
    rng = numpy.random.default_rng(2)
    lines, along, count = 3 * 40, 30, 3
    own = [rng.integers(0, 3, (lines, along)).astype(numpy.float32) + 20 * block for block in range(count)]
    # Two blocks agree in a few lines of what they share.
    for at, pair in ((33, (0, 1)), (90, (1, 2))):
        own[pair[1]][at - 2 : at + 2] = own[pair[0]][at - 2 : at + 2] = 7
    spans = [slice(max(0, 40 * block - 24), min(lines, 40 * (block + 1) + 24)) for block in range(count)]
    turned = [numpy.moveaxis(map[span], 0, axis) for map, span in zip(own, spans)]
    maps = dask_array.concatenate([dask_array.from_array(map, chunks=-1) for map in turned], axis)
    joined = numpy.moveaxis(bpstereo.dask._joined(maps, axis, (24, 24), 16).compute(), axis, 0)
    expected = numpy.concatenate([own[0][:33], own[1][33:90], own[2][90:]])
    assert numpy.array_equal(joined, expected)


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
    with pytest.raises(ValueError, match="algorithm"):
        bpstereo.dask.match(*images, labels=16, algorithm="ctbp")
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
            victim, *others = client.run(os.getpid).values()
            future = client.compute(lazy, retries=3)
            # It dies as soon as some blocks are matched.
            while not any(client.who_has().values()):
                assert not future.done(), "the worker died too late"
                time.sleep(0.01)
            os.kill(victim, signal.SIGKILL)
            found = future.result(timeout=120)
            assert victim not in client.run(os.getpid).values() and others
    assert numpy.array_equal(found, expected, equal_nan=True)


@pytest.mark.skipif(sys.platform != "linux", reason="the system tells the peak memory of a process")
def test_a_worker_holds_no_more_than_predicted():
    distributed = pytest.importorskip("distributed")
    left, right, _ = scene(1100, 2200, 60)
    images = blocks(left, right, chunks=(512, 1024))
    predicted = bpstereo.dask.peak_bytes(*images, labels=64)

    def held():
        with open("/proc/self/status") as status:
            return 1024 * int(next(line.split()[1] for line in status if line.startswith("VmHWM:")))

    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            client.run(lambda: __import__("bpstereo.dask"))
            before, = client.run(held).values()
            # Whatever Dask keeps beside the block that is matched: blocks that were read, and maps that wait to be joined.
            kept = sum(image.nbytes for image in (left, right)) + 3 * 4 * left.size
            bpstereo.dask.match(*images, labels=64).sum().compute()
            after, = client.run(held).values()
    assert after - before <= predicted + kept, (after - before, predicted, kept)


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
