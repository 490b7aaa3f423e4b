"""Arrays in, arrays out: the program's answer, whatever the arrays look like."""
import os
import subprocess
import threading
import warnings

import bpstereo
import numpy
import pytest

from conftest import ROOT, shifted

SAMPLE = ROOT / "bench-data" / "sample"


@pytest.mark.parametrize("device", [device["backend"] for device in bpstereo.devices()])
def test_maps_are_those_of_the_program(program, tmp_path, device):
    images = [SAMPLE / f"{side}.png" for side in ("left", "right")]
    command = [program, "match", *images, "--output", "map.npy", "--unknown", "nan", "--confidence", "trust.npy", "--backend", device]
    for options, words in [({}, []), ({"quality": "best", "fill": False}, ["--quality", "best", "--fill", "off"])]:
        subprocess.run([*map(str, command), *words, "--quiet"], cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)
        matcher = bpstereo.Matcher(backend=device, confidence=True, **options)
        ours = matcher.compute(*map(bpstereo.read_image, images))
        assert ours.tobytes() == numpy.load(tmp_path / "map.npy").tobytes()
        assert matcher.confidence.tobytes() == numpy.load(tmp_path / "trust.npy").tobytes()


def test_values_of_all_types_mean_the_same(pair):
    left, right = pair
    expected = bpstereo.match(left, right, labels=16)
    assert abs(numpy.nanmedian(expected) - 3) < 0.1
    as_types = [
        lambda image: image.astype(numpy.uint16) * 257,
        lambda image: image.astype(numpy.float32),
        lambda image: (image / 255).astype(numpy.float32),
        lambda image: numpy.dstack([image] * 3),
        lambda image: image[..., None],
    ]
    for of_type in as_types:
        assert numpy.array_equal(bpstereo.match(of_type(left), of_type(right), labels=16), expected, equal_nan=True)


def test_strides_make_no_difference():
    rng = numpy.random.default_rng(2)
    for dtype, most in [(numpy.uint8, 255), (numpy.uint16, 65535), (numpy.float32, 255)]:
        for shape in [(40, 56), (40, 56, 3)]:
            image = (rng.random(shape) * most).astype(dtype)
            other = numpy.roll(image, -2, axis=1)
            expected = bpstereo.match(image, other, labels=8)
            turned = [numpy.asfortranarray(image), image[::-1, ::-1].copy()[::-1, ::-1], numpy.repeat(image, 2, axis=1)[:, ::2]]
            packed = numpy.zeros(image.shape, [("flag", "u1"), ("value", dtype)])
            packed["value"] = image
            turned.append(packed["value"])
            if image.ndim == 3:
                turned.append(image[..., ::-1].copy()[..., ::-1])
            for strange in turned:
                assert numpy.array_equal(strange, image) and not strange.flags.c_contiguous
                assert numpy.array_equal(bpstereo.match(strange, other, labels=8), expected, equal_nan=True)


def test_values_of_any_range_are_stretched_as_by_the_program(program, tmp_path, pair):
    wide = [image.astype(numpy.float32) * 2.5 - 40 for image in pair]
    wide[0][:6] = numpy.nan
    for name, image in zip(["left.npy", "right.npy"], wide):
        numpy.save(tmp_path / name, image)
    command = [program, "match", "left.npy", "right.npy", "-o", "map.npy", "--stretch", "--unknown", "nan", "--quiet", "--confidence", "trust.npy"]
    subprocess.run(list(map(str, command)), cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)
    expected = numpy.load(tmp_path / "map.npy")
    assert numpy.isnan(expected[:6]).all() and numpy.isfinite(expected[6:]).all()
    matcher = bpstereo.Matcher(stretch=True, confidence=True)
    assert matcher.options["stretch"] is True and bpstereo.Matcher().options["stretch"] is False
    assert matcher.compute(*wide).tobytes() == expected.tobytes()
    assert matcher.confidence.tobytes() == numpy.load(tmp_path / "trust.npy").tobytes()
    assert bpstereo.match(*wide, stretch=True).tobytes() == expected.tobytes()
    with pytest.raises(ValueError, match="left"):
        bpstereo.match(*wide)
    with pytest.raises(TypeError, match="`stretch`"):
        bpstereo.match(*wide, stretch=1)


def test_integers_of_any_range_are_stretched(pair):
    expected = bpstereo.match(*pair, labels=16, stretch=True)
    assert abs(numpy.nanmedian(expected) - 3) < 0.1
    for dtype, of in [(numpy.uint16, lambda image: image * 5 + 900), (numpy.float32, lambda image: image * 1e-6)]:
        found = bpstereo.match(*(of(image.astype(dtype)) for image in pair), labels=16, stretch=True)
        assert numpy.mean(numpy.abs(found - expected) < 0.25) > 0.98
    coloured = [numpy.dstack([image] * 3) for image in pair]
    assert numpy.array_equal(bpstereo.match(*coloured, labels=16, stretch=True), expected)
    # One image may have been made of floats since.
    mixed = pair[0].astype(numpy.uint16) * 5 + 900, pair[1].astype(numpy.float32) * 5 + 900
    assert numpy.mean(numpy.abs(bpstereo.match(*mixed, labels=16, stretch=True) - expected) < 0.25) > 0.98


def test_stretching_counts_as_memory():
    image = numpy.zeros((1000, 1000, 3), numpy.uint16)
    matcher = bpstereo.Matcher(labels=16, stretch=True, max_memory=50 << 20)
    with pytest.raises(MemoryError, match="stretching 1000x1000"):
        matcher.compute(image, image)
    assert bpstereo.Matcher(labels=16, stretch=True).peak_bytes(image, image) >= image.size * 8


def test_floats_of_a_pair_have_one_scale(pair):
    left, right = (image.astype(numpy.float32) for image in pair)
    dark = numpy.minimum(left, 1), right
    with pytest.warns(bpstereo.PairWarning):
        assert numpy.isfinite(bpstereo.match(*dark, labels=16)).any()
    with pytest.raises(ValueError, match="right"):
        bpstereo.match(left, right * 2)


def test_what_says_that_it_is_an_array_is_one(pair):
    class Image:
        def __init__(self, array):
            self.array = array

        def __array__(self, dtype=None, copy=None):
            return self.array

    left, right = pair
    assert numpy.array_equal(bpstereo.match(Image(left), Image(right)), bpstereo.match(left, right), equal_nan=True)


def test_numpy_makes_no_copy_of_the_images():
    import tracemalloc

    left, right = shifted(600, 800, 5)
    matcher = bpstereo.Matcher(labels=16)
    out = matcher.compute(left, right)
    tracemalloc.start()
    try:
        matcher.compute(left, right, out)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < left.nbytes / 4, peak


def test_bytes_without_gaps_are_read_where_they_lie(pair):
    left, right = pair
    place = bpstereo._bpstereo._read_at
    coloured = numpy.dstack([left, right, left])
    for array in [left, coloured, left[5:9], left[..., None]]:
        assert place(array) == array.ctypes.data
    for array in [left[:, 1:], left[::-1], coloured[..., ::-1], left.astype(numpy.uint16), left.astype(numpy.float32)]:
        assert place(array) != array.ctypes.data
    # What is not copied needs no memory.
    matcher = bpstereo.Matcher(labels=16)
    wide = numpy.repeat(left, 2, axis=1)[:, ::2]
    assert matcher.peak_bytes(wide, right) - matcher.peak_bytes(left, right) == left.nbytes


def test_an_array_that_changes_during_its_match_harms_nobody():
    left, right = shifted(300, 400, 5)
    matcher, noise = bpstereo.Matcher(labels=16), numpy.random.default_rng(3)

    ended = threading.Event()

    def change():
        while not ended.is_set():
            left[:] = noise.integers(256, size=left.shape)

    writer = threading.Thread(target=change)
    writer.start()
    try:
        for options in [{}, {"check": True, "confidence": True}, {"profile": "census32"}]:
            assert bpstereo.Matcher(labels=16, **options).compute(left, right).dtype == numpy.float32
    finally:
        ended.set()
        writer.join()
    assert numpy.array_equal(matcher.compute(left, right), bpstereo.Matcher(labels=16).compute(left, right), equal_nan=True)


def test_the_map_is_written_where_the_caller_says(pair):
    left, right = pair
    matcher = bpstereo.Matcher(labels=16)
    expected = matcher.compute(left, right)
    out = numpy.zeros_like(expected)
    address = out.ctypes.data
    assert matcher.compute(left, right, out=out) is out and out.ctypes.data == address
    assert numpy.array_equal(out, expected, equal_nan=True)
    sparse = numpy.zeros((48, 128), numpy.float32)[:, ::2]
    matcher.compute(left, right, sparse)
    assert numpy.array_equal(sparse, expected, equal_nan=True)
    fixed = numpy.zeros_like(expected)
    fixed.flags.writeable = False
    for wrong, error in [(fixed, ValueError), (numpy.zeros((48, 64)), TypeError), (out[1:], ValueError), ([], TypeError)]:
        with pytest.raises(error):
            matcher.compute(left, right, wrong)


@pytest.mark.parametrize(
    ("wrong", "error", "words"),
    [
        (numpy.zeros((4, 4, 4, 4), numpy.uint8), ValueError, ["left", "shape", "[height][width]"]),
        (numpy.zeros((4, 4, 2), numpy.uint8), ValueError, ["left", "shape"]),
        (numpy.zeros(16, numpy.uint8), ValueError, ["left", "shape"]),
        (numpy.zeros((0, 4), numpy.uint8), ValueError, ["left", "empty"]),
        (numpy.zeros((48, 63), numpy.uint8), ValueError, ["63x48", "64x48"]),
        (numpy.zeros((48, 64), numpy.int64), TypeError, ["left", "int64", "uint8"]),
        (numpy.zeros((48, 64), bool), TypeError, ["left", "bool"]),
        (numpy.full((48, 64), numpy.nan, numpy.float32), ValueError, ["left", "NaN"]),
        (numpy.full((48, 64), 256, numpy.float32), ValueError, ["left", "256", "0 to 1"]),
        (numpy.full((48, 64), -1, numpy.float32), ValueError, ["left", "-1"]),
        ([[1, 2], [3, 4]], TypeError, ["left", "list", "uint8"]),
        (None, TypeError, ["left", "NoneType"]),
        ("left.png", TypeError, ["left", "str"]),
    ],
)
def test_wrong_images_are_named(pair, wrong, error, words):
    with pytest.raises(error) as caught:
        bpstereo.match(wrong, pair[1])
    assert all(word in str(caught.value) for word in words), caught.value


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"labls": 3}, ValueError, ["labls", "labels"]),
        ({"labels": 0}, ValueError, ["labels"]),
        ({"labels": -3}, ValueError, ["labels"]),
        ({"labels": "many"}, ValueError, ["many", "auto"]),
        ({"labels": 1.5}, ValueError, ["labels"]),
        ({"labels": True}, ValueError, ["labels"]),
        ({"fill": "off"}, TypeError, ["fill", "str"]),
        ({"threads": "two"}, ValueError, ["threads"]),
        ({"median": 4}, ValueError, ["median", "3, 5 or 7"]),
        ({"algorithm": "sgm"}, ValueError, ["sgm", "cfbp"]),
        ({"quality": "good"}, ValueError, ["good", "best"]),
        ({"backend": "cuda"}, bpstereo.BackendUnavailable, ["cuda", "rayon"]),
        ({"backend": "rayon:99"}, bpstereo.BackendUnavailable, ["99"]),
        ({"max_memory": 1000}, MemoryError, ["max_memory"]),
    ],
)
def test_wrong_options_are_named(pair, options, error, words):
    with pytest.raises(error) as caught:
        bpstereo.match(*pair, **options)
    assert all(word in str(caught.value) for word in words), caught.value


def test_options_have_the_librarys_forms(pair):
    expected = bpstereo.match(*pair, labels=16, algorithm="cfbp")
    for options in [
        {"labels": numpy.int64(16), "algorithm": {"name": "cfbp"}},
        {"labels": {"count": 16}, "algorithm": {"name": "cfbp", "loops": {"total": {"k": None, "schedule": "sync"}}}},
    ]:
        assert numpy.array_equal(bpstereo.match(*pair, **options), expected, equal_nan=True)
    assert bpstereo.Matcher(labels=16).options["labels"] == {"count": 16}


def test_a_matcher_tells_what_it_did(pair):
    matcher = bpstereo.Matcher(labels=16, min_disparity=-4, energy=True)
    assert matcher.times is None and matcher.energy is None and matcher.settings is None and matcher.warnings == []
    matcher.compute(*pair)
    times = matcher.times
    assert set(times) == {"planning", "matching", "finishing", "total"}
    assert abs(sum(times.values()) - 2 * times["total"]) < 1e-6
    assert matcher.settings["labels"] == 16 and matcher.settings["min_disparity"] == -4
    assert matcher.energy["total"] == matcher.energy["data"] + matcher.energy["smoothness"]
    assert matcher.device["name"] in repr(matcher)
    assert matcher.confidence is None


def test_problems_of_a_pair_are_warnings(pair):
    left, _ = pair
    with pytest.warns(bpstereo.PairWarning, match="same image") as caught:
        bpstereo.match(left, left)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        matcher = bpstereo.Matcher()
        matcher.compute(left, left)
    assert any("same image" in text for text in matcher.warnings)


def test_warm_starts_are_those_of_the_program(program, tmp_path):
    scene = shifted(48, 64, 3)
    rng = numpy.random.default_rng(6)
    # Noise of each frame's own: a warm start remembers that of the frames before.
    frames = [[numpy.clip(image + rng.normal(0, 60, image.shape), 0, 255).astype(numpy.uint8) for image in scene] for _ in range(3)]
    for index, pair in enumerate(frames):
        for side, image in zip(["left", "right"], pair):
            (tmp_path / f"{side}{index}.pgm").write_bytes(b"P5\n64 48\n255\n" + image.tobytes())
    command = [program, "match", "--video", "left%d.pgm", "right%d.pgm", "-o", "maps", "--format", "npy", "--unknown", "nan", "--quiet",
               "--labels", "16", "--align", "off", "--algorithm", "cfbp", "--half-steps", "2"]
    options = {"labels": 16, "align": "off", "algorithm": {"name": "cfbp", "loops": {"half_steps": 2}}}
    matcher, cold = bpstereo.Matcher(**options), bpstereo.Matcher(**options)
    subprocess.run([*map(str, command), "--warm-start"], cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)
    for index, pair in enumerate(frames):
        found = matcher.compute(*pair, warm=index > 0)
        assert found.tobytes() == numpy.load(tmp_path / "maps" / f"{index}.npy").tobytes()
        assert numpy.array_equal(found, cold.compute(*pair), equal_nan=True) == (index == 0)


def test_warm_starts_need_an_algorithm_that_keeps_messages(pair):
    matcher = bpstereo.Matcher(labels=16)
    matcher.compute(*pair)
    with pytest.raises(ValueError, match="warm"):
        matcher.compute(*pair, warm=True)


def test_gpus_are_among_the_devices_where_they_are_required():
    """Otherwise the tests above would be without their cases for GPUs."""
    if os.environ.get("BP_REQUIRE_GPU") != "1":
        pytest.skip("BP_REQUIRE_GPU=1 is not set")
    assert "vulkan" in [device["backend"] for device in bpstereo.devices()]


def test_tiles_fit_into_little_memory():
    left, right = shifted(700, 900, 6)
    matcher = bpstereo.Matcher(labels=64, max_memory=60 << 20)
    found = matcher.compute(left, right)
    assert abs(numpy.nanmedian(found) - 6) < 0.1
