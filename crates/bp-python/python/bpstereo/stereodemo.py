"""The method "Belief propagation" in stereodemo, a viewer that shows stereo matchers side by side.

    python -m bpstereo.stereodemo left.png right.png

takes the arguments of stereodemo. It has no plug-ins, so this adds the method to its list.
"""

from __future__ import annotations

import time
from typing import Any

import numpy
import stereodemo  # type: ignore[import-untyped]
from stereodemo import visualizer
from stereodemo.methods import (  # type: ignore[import-untyped]
    Config,
    EnumParameter,
    InputPair,
    IntParameter,
    StereoMethod,
    StereoOutput,
)

from ._bpstereo import Matcher


class BeliefPropagation(StereoMethod):
    """The method "Belief propagation"."""

    def __init__(self, config: Config) -> None:
        super().__init__("Belief propagation", "Belief propagation (bpstereo)", {}, config)
        self.reset_defaults()

    def reset_defaults(self) -> None:
        """Balanced quality; labels found in the images."""
        labels = "The number of disparities from 0 on. 0: as many as the images need"
        self.parameters.update({
            "Quality": EnumParameter("Trades time for precision", 1, ["fast", "balanced", "best"]),
            "Labels": IntParameter(labels, 0, 0, 640),
        })

    def compute_disparity(self, input: InputPair) -> StereoOutput:
        """The disparities of the left image in pixels, negative where unknown, and the seconds that matching took."""
        labels = self.parameters["Labels"].value
        matcher = Matcher(quality=self.parameters["Quality"].value, labels=labels or "auto")
        # The viewer's colours are blue, green, red.
        left, right = input.left_image[..., ::-1], input.right_image[..., ::-1]
        begun = time.perf_counter()
        disparity = matcher.compute(left, right)
        seconds = time.perf_counter() - begun
        return StereoOutput(numpy.nan_to_num(disparity, nan=-1), input.left_image, seconds)


def main() -> None:
    """Opens the viewer with this method before its own."""
    window = visualizer.Visualizer

    def with_ours(methods: dict[str, Any], *others: Any) -> Any:
        ours = BeliefPropagation(next(iter(methods.values())).config)
        return window({ours.name: ours} | methods, *others)

    visualizer.Visualizer = with_ours
    stereodemo.main()


if __name__ == "__main__":
    main()
