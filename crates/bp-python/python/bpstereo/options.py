"""The options of a match, for type checkers and editors."""

from __future__ import annotations

from typing import Any, Literal, TypedDict


class Options(TypedDict, total=False):
    """The keywords of `match` and `Matcher`. All have a default; `Matcher(...).options` shows the values.

    The library's documentation describes what they do. None stands for what `quality` or the images suggest.
    """

    algorithm: str | dict[str, Any]
    quality: Literal["fast", "balanced", "best"]
    profile: str | None
    slope: int | None
    truncation: int | None
    edge_threshold: int | None
    stretch: bool
    align: Literal["off", "auto"] | dict[str, Any]
    labels: Literal["auto", "quarter_of_width"] | int | dict[str, int]
    min_disparity: int | None
    check: bool | None
    unique: bool | None
    speckle: int | None
    fill: bool
    median: int | None
    subpixel: bool | None
    confidence: bool
    energy: bool
    backend: str
    device: str | None
    threads: int | None
    max_memory: int | None
