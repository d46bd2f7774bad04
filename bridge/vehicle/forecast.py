"""The tracking error foretold with an accepted diagnosis, and the thrust that a vehicle credits its thrusters with.

Both are kept in the sidecar of a parameter file: the next dive is compared with the first, an upload with the second.
"""

from dataclasses import dataclass

from bridge.vehicle.coefficients import DOFS


@dataclass(frozen=True)
class ForecastRow:
    """Tracking error of an axis over a whole mission, rms below 0.5 Hz, m/s or rad/s (`unit`).

    mode: of the feed-forward that it is foretold for, as in `Mode.word`. before: as measured in the dive that was
    diagnosed, which was flown in the mode `flown`. after: foretold. asked: rms of the reference's velocity then, by
    which another mission is known.
    """

    axis: str
    unit: str
    mode: str
    flown: str
    before: float
    after: float
    asked: float

    def __post_init__(self) -> None:
        if self.axis not in DOFS or self.unit not in ("m/s", "rad/s"):
            raise ValueError(f"foretold: '{self.axis}' in {self.unit} is no speed of an axis")


@dataclass(frozen=True)
class Credit:
    """Thrust of a thruster (numbered from 1) over its curve, as the vehicle's own allocation has it and as it is.

    assumed: gain in the vehicle file that the diagnosis went by. found: accepted gain, over and above that.
    allocated: gain that the allocation went by in that dive, None if it was not recorded. acting: whether accepted
    effects were part of it, because the feed-forward was applied.
    """

    thruster: int
    assumed: float
    found: float
    allocated: float | None
    acting: bool

    def __post_init__(self) -> None:
        if self.thruster < 1 or not (self.assumed > 0 and self.found > 0):
            raise ValueError("credits: thrusters are numbered from 1, and gains are above 0")

    @property
    def true(self) -> float:
        """Thrust over the curve as the diagnosis has it."""
        return self.assumed * self.found


TWICE = 0.05
"""Relative difference of two gains from which they are different ones: a diagnosis tells a gain to some 2 %."""
