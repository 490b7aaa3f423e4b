"""The Python in the project's pages runs as it stands there."""
import re
import shutil
import types

import bpstereo
import numpy
import pytest

from conftest import ROOT, shifted

SAMPLE = ROOT / "bench-data" / "sample"
PAGES = ["README.md", "crates/bp-python/README.md", "docs/python.md", "docs/cameras.md"]


def blocks(page):
    return re.findall(r"^```python\n(.*?)^```$", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)


def frames():
    pair = [bpstereo.read_image(f"{side}.png") for side in ("left", "right")]
    return {"frames": [pair] * 2}


def chunked():
    """Images as dask arrays, under the names of the pair."""
    dask_array = pytest.importorskip("dask.array")
    return {side: dask_array.from_array(image, chunks=(64, 128)) for side, image in zip(("left", "right"), shifted(128, 256, 3))}


def ray():
    """Stands for Ray, which is not installed: what it would run elsewhere runs here, at once."""
    def remote(function):
        return types.SimpleNamespace(remote=function)
    return {"ray": types.SimpleNamespace(remote=remote, get=list), "pairs": [shifted(48, 64, 3)] * 2}


def raw_pair():
    """Raw images, and their calibration in a file."""
    rng = numpy.random.default_rng(7)
    camera, lens = "[400, 0, 320, 0, 400, 240, 0, 0, 1]", "[-0.1, 0.01, 0, 0, 0]"
    with open("stereo.yml", "w") as file:
        file.write(f"M1: {camera}\nD1: {lens}\nM2: {camera}\nD2: {lens}\nR: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nT: [-100, 0, 0]\n")
    return {name: rng.integers(0, 256, (480, 640, 3), dtype=numpy.uint8) for name in ("raw_left", "raw_right")}


#: What a reader's own program has before a block with this text.
BEFORE = {
    "for left, right in frames": frames,
    "bpstereo.dask.match(": chunked,
    "@ray.remote": ray,
    "raw_left, raw_right": raw_pair,
}


@pytest.mark.parametrize("page", PAGES)
@pytest.mark.filterwarnings("ignore::bpstereo.PairWarning")
def test_the_code_of_a_page_runs_from_top_to_bottom(page, tmp_path, monkeypatch):
    assert blocks(page), "the page has no Python"
    monkeypatch.chdir(tmp_path)
    for name in ("left.png", "right.png", "calib.txt"):
        shutil.copy(SAMPLE / name, tmp_path)
    names = {"bpstereo": bpstereo}
    for code in blocks(page):
        for text, before in BEFORE.items():
            if text in code:
                names |= before()
        exec(compile(code, page, "exec"), names)
        for file in re.findall(r"write_\w+\(\"(.+?)\"", code):
            assert (tmp_path / file).stat().st_size > 1000
        if "dask" in code:
            assert numpy.isfinite(names["disparity"].compute()).any()


def test_every_preparation_serves_a_block():
    code = "".join(block for page in PAGES for block in blocks(page))
    assert all(text in code for text in BEFORE)
