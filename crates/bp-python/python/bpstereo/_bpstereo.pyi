from os import PathLike
from typing import Any, Callable, Protocol, final

import numpy
from numpy.typing import NDArray
from typing_extensions import Unpack

from .options import Options

__all__ = [
    "BackendUnavailable",
    "Calibration",
    "DeviceError",
    "Matcher",
    "PairWarning",
    "__version__",
    "devices",
    "match",
    "read_image",
    "read_map",
    "write_map",
    "write_picture",
    "write_points",
]

__version__: str

class BackendUnavailable(RuntimeError): ...
class DeviceError(RuntimeError): ...
class PairWarning(UserWarning): ...

class _Image(Protocol):
    def __array__(self) -> NDArray[Any]: ...

_Progress = Callable[[int, int], object]
_Path = str | PathLike[str]

def match(
    left: _Image, right: _Image, *, progress: _Progress | None = None, **options: Unpack[Options]
) -> NDArray[numpy.float32]: ...

@final
class Matcher:
    def __new__(cls, **options: Unpack[Options]) -> Matcher: ...
    def compute(
        self,
        left: _Image,
        right: _Image,
        out: NDArray[numpy.float32] | None = None,
        *,
        warm: bool = False,
        progress: _Progress | None = None,
    ) -> NDArray[numpy.float32]: ...
    @property
    def confidence(self) -> NDArray[numpy.float32] | None: ...
    @property
    def times(self) -> dict[str, float] | None: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def energy(self) -> dict[str, int] | None: ...
    @property
    def settings(self) -> dict[str, Any] | None: ...
    @property
    def options(self) -> dict[str, Any]: ...
    @property
    def device(self) -> dict[str, Any]: ...

@final
class Calibration:
    def __new__(
        cls,
        focal: float,
        baseline: float,
        doffs: float = 0.0,
        principal_point: tuple[float, float] | None = None,
    ) -> Calibration: ...
    @staticmethod
    def read(path: _Path) -> Calibration: ...
    def depth(self, disparity: NDArray[numpy.float32]) -> NDArray[numpy.float32]: ...
    def points(self, disparity: NDArray[numpy.float32]) -> NDArray[numpy.float32]: ...
    @property
    def focal(self) -> float: ...
    @property
    def baseline(self) -> float: ...
    @property
    def doffs(self) -> float: ...
    @property
    def principal_point(self) -> tuple[float, float] | None: ...

def devices() -> list[dict[str, Any]]: ...
def read_image(path: _Path, max_megapixels: int = 100) -> NDArray[numpy.uint8]: ...
def read_map(path: _Path, scale: float | None = None, max_megapixels: int = 100) -> NDArray[numpy.float32]: ...
def write_map(path: _Path, disparity: NDArray[numpy.float32]) -> None: ...
def write_picture(path: _Path, disparity: NDArray[numpy.float32]) -> None: ...
def write_points(
    path: _Path, disparity: NDArray[numpy.float32], left: _Image, calibration: Calibration
) -> None: ...
