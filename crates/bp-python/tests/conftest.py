"""A pair with a known answer, and the program to compare with."""
import os
import pathlib

import numpy
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]
PROGRAM = os.environ.get("BP_PROGRAM")


def shifted(height, width, shift, seed=1):
    """Noise, and the same noise `shift` pixels further left."""
    scene = numpy.random.default_rng(seed).integers(0, 256, (height, width + shift), dtype=numpy.uint8)
    return numpy.ascontiguousarray(scene[:, :width]), numpy.ascontiguousarray(scene[:, shift:])


@pytest.fixture
def pair():
    """Left pixels have the disparity 3."""
    return shifted(48, 64, 3)


@pytest.fixture(autouse=True)
def names_of_doctests(doctest_namespace):
    import bpstereo
    left, right = shifted(48, 64, 3)
    doctest_namespace.update(bpstereo=bpstereo, numpy=numpy, left=left, right=right)


@pytest.fixture(scope="session")
def program():
    """The program `bp`, from the same commit."""
    if not PROGRAM:
        pytest.skip("BP_PROGRAM is not set")
    return pathlib.Path(PROGRAM).resolve()
