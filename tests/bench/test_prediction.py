"""What the page says of a prediction beside the anchor from the literature."""

import pytest

from bench import prediction
from bench.prediction import FLOOR, WHOLE


def _found(off_m: float, floor_m: float) -> dict[str, prediction.Data]:
    names = [name + suffix for name in prediction.methods() for suffix in ("", WHOLE)]
    data = {"off_m": {**{name: [off_m] for name in names}, FLOOR: [floor_m]}, "stated": {}}
    return {f"{group} 1": data for group in (*prediction.CONFIGURATIONS, prediction.DRAWN)}


@pytest.mark.parametrize(
    ("off_m", "floor_m", "verdict", "why"),
    [(0.034, 0.035, "**missed**", "due to the disturbance"), (0.031, 0.030, "met", "hovering 3.0.")],
)
def test_the_anchor_has_a_verdict_by_method_beside_the_floor(
    off_m: float, floor_m: float, verdict: str, why: str
) -> None:
    told = " ".join("\n".join(prediction._lines(_found(off_m, floor_m))).split())
    size = f"{100 * off_m:.1f}"
    assert f"`likelihood` survey {size}, hovering {size}: {verdict}" in told
    assert "another vehicle in other water" in told
    assert why in told
