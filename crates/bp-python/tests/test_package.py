"""The package itself: its stubs, its examples, and the instructions that it chooses."""
import doctest
import importlib
import inspect
import pkgutil
import platform
import subprocess
import sys
import typing

import bpstereo
import numpy
import pytest

from conftest import ROOT, shifted


def documented():
    yield "bpstereo", bpstereo
    for name in bpstereo.__all__:
        value = getattr(bpstereo, name)
        yield name, value
        if inspect.isclass(value):
            yield from ((f"{name}.{member}", part) for member, part in vars(value).items() if not member.startswith("_"))


@pytest.mark.parametrize(("name", "value"), [pair for pair in documented() if pair[0] != "__version__"])
def test_everything_has_a_docstring_whose_examples_run(name, value, doctest_namespace):
    text = inspect.getdoc(value)
    assert text and len(text) > 20, name
    test = doctest.DocTestParser().get_doctest(text, dict(doctest_namespace), name, name, 0)
    assert not doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test).failed


@pytest.mark.parametrize("name", [module.name for module in pkgutil.iter_modules(bpstereo.__path__) if module.name != "_bpstereo"])
def test_the_examples_of_every_module_run(name, doctest_namespace):
    # Some need packages that are not there.
    module = pytest.importorskip(f"bpstereo.{name}", exc_type=ImportError)
    done = doctest.testmod(module, extraglobs=dict(doctest_namespace), optionflags=doctest.ELLIPSIS)
    assert not done.failed and (done.attempted > 0) == (">>>" in inspect.getsource(module))


def test_the_stubs_agree_with_the_module(tmp_path):
    pytest.importorskip("mypy")
    # stereodemo is there, but not what it imports.
    (tmp_path / "allowed").write_text("bpstereo.stereodemo\n")
    options = ["--allowlist", tmp_path / "allowed", "--ignore-unused-allowlist"]
    done = subprocess.run([sys.executable, "-m", "mypy.stubtest", "bpstereo", *options], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_every_option_is_named():
    names = list(bpstereo.Matcher().options)
    assert list(bpstereo.Options.__annotations__) == names
    assert all(f"`{name}`" in bpstereo.Matcher.__doc__ for name in names)


def test_mypy_accepts_right_calls_and_refuses_wrong_ones(tmp_path):
    pytest.importorskip("mypy")
    begin = "import bpstereo, numpy\nimage = numpy.zeros((9, 9), numpy.uint8)\n"
    for call, accepted in [
        ("bpstereo.match(image, image, labels=16, quality='best').mean()", True),
        ("bpstereo.match(image, image, labls=16)", False),
        ("bpstereo.Matcher(quality='good')", False),
        ("bpstereo.Matcher().compute(image)", False),
        ("bpstereo.StereoBP.create(0, 16).compute(image, image)", True),
    ]:
        (tmp_path / "script.py").write_text(begin + call)
        done = subprocess.run([sys.executable, "-m", "mypy", "--strict", "script.py"], cwd=tmp_path, capture_output=True, text=True)
        assert (done.returncode == 0) == accepted, f"{call}: {done.stdout}"


@pytest.mark.skipif(platform.machine() != "x86_64" or not sys.platform.startswith("linux"), reason="reads x86's flags in /proc")
def test_one_wheel_has_the_code_for_every_instruction_set():
    names = {device["backend"]: device["name"] for device in bpstereo.devices() if device["backend"].startswith("rayon")}
    with open("/proc/cpuinfo") as file:
        flags = next(line for line in file if line.startswith(("flags", "Features"))).split()
    expected = [name for flag, name in [("avx512_vbmi2", "AVX-512"), ("avx2", "AVX2"), ("sse4_2", "SSE4.2"), ("sse2", "SSE2")] if flag in flags]
    assert [name for name in expected if any(name in told for told in names.values())] == expected
    assert expected[0] in bpstereo.Matcher().device["name"]
    maps = [bpstereo.match(*shifted(60, 90, 4), labels=16, backend=backend) for backend in names]
    assert all(numpy.array_equal(one, maps[0], equal_nan=True) for one in maps)


def test_the_tour_makes_its_page(tmp_path):
    sample = ROOT / "bench-data" / "sample"
    script = ROOT / "crates" / "bp-python" / "examples" / "tour.py"
    images = [sample / name for name in ("left.png", "right.png", "calib.txt")]
    subprocess.run([sys.executable, script, *images, tmp_path], check=True)
    page = (tmp_path / "tour.md").read_text()
    shown = [name for name in ("map.png", "confidence.png", "sure.png") if f"({name})" in page and (tmp_path / name).exists()]
    assert len(shown) == 3 and "labels from" in page and (tmp_path / "cloud.ply").stat().st_size > 10_000


def test_the_viewers_recording_has_the_images_the_map_and_the_points(tmp_path):
    pytest.importorskip("rerun")
    chunk = pytest.importorskip("rerun.chunk")
    sample = ROOT / "bench-data" / "sample"
    script = ROOT / "crates" / "bp-python" / "examples" / "rerun_viewer.py"
    files = [sample / name for name in ("left.png", "right.png", "calib.txt")]
    subprocess.run([sys.executable, script, *files, tmp_path / "pair.rrd"], check=True)
    recorded = {}
    for part in chunk.RrdReader(tmp_path / "pair.rrd").stream():
        columns = part.to_record_batch()
        recorded[part.entity_path] = {name: columns[name].flatten() for name in columns.schema.names if ":" in name}
    left, right = map(bpstereo.read_image, files[:2])
    for side, image in (("left", left), ("right", right)):
        assert numpy.array_equal(buffer(recorded[f"/pair/{side}"], "Image", numpy.uint8).reshape(image.shape), image)
    calibration, disparity = bpstereo.Calibration.read(files[2]), bpstereo.match(left, right, quality="best")
    depth, points = calibration.depth(disparity), calibration.points(disparity)
    assert numpy.array_equal(buffer(recorded["/map"], "DepthImage", numpy.float32), numpy.nan_to_num(depth).ravel())
    assert recorded["/map"]["DepthImage:meter"].to_pylist() == [1000]
    known = numpy.isfinite(points).all(axis=2)
    shown = recorded["/world/points"]
    # Rerun has metres, and colours as 0xRRGGBBAA.
    assert numpy.allclose(shown["Points3D:positions"].flatten().to_numpy().reshape(-1, 3), points[known] / 1000)
    colours = shown["Points3D:colors"].to_numpy()
    assert numpy.array_equal(numpy.stack([colours >> 24, colours >> 16 & 255, colours >> 8 & 255], axis=1), left[known])


def buffer(recorded, kind, dtype):
    """The values of an image in a recording."""
    return recorded[f"{kind}:buffer"].flatten().to_numpy().view(dtype)
