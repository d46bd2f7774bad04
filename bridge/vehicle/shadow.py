"""Judges the feed-forward in shadow mode: does the model predict the force that the PID had to give?

A PID acts late by design, so the feed-forward of a reference is never compared with the PID's force directly.
Instead, the model predicts the force that the measured motion took, by the momentum balance:

    mean force over 2 s = mass times change of velocity / 2 s + damping times mean velocity

It contains no derivative of a noisy reading: only the velocities at both ends of the 2 s count. Over the last minute
in FF_MODE 1, in each axis that the feed-forward moved for 10 s, the prediction has to explain seven tenths of the
force that the thrusters were asked for:

    1 - sum (force - model)^2 / sum force^2 >= 0.7

In simulation, a model from half of the true one to 1.4 times it explains that in each minute of the validation mission,
0.4 times it or twice it in none: a feed-forward that is too small leaves work to the PID, while one that is too large
pushes.
"""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS, feedforward
from bridge.vehicle.references import Reference, Six

BLOCK_S: Final = 2.0
WINDOW_S: Final = 60.0
MOVED_S: Final = 10.0
MOVED_SHARE: Final = 0.05
"""Share of the reach: a smaller feed-forward is lost among the other forces on a vehicle."""

LEAST_FED: Final = 1e-6
LEAST_EXPLAINED: Final = 0.7
LONGEST_TICK_S: Final = 0.25
UNLIMITED: Final = (math.inf,) * len(DOFS)
NONE_FLOWN: Final = "shadow: none flown, seatrial ff shadow first"


@dataclass
class _Block:
    """Sums over 2 s in surge, sway and yaw, N s and N m s: `given` commanded to the thrusters, `predicted` by the
    model, `fed` the magnitude of the feed-forward."""

    seconds: float = 0.0
    given: list[float] = field(default_factory=lambda: [0.0] * 3)
    predicted: list[float] = field(default_factory=lambda: [0.0] * 3)
    fed: list[float] = field(default_factory=lambda: [0.0] * 3)


class Shadow:
    """Accumulates the ticks flown in shadow; `reach` (6,) is the vehicle's largest wrench, N and N m."""

    def __init__(self, reach: Sequence[float]) -> None:
        self._least_fed = tuple(max(MOVED_SHARE * reach[dof], LEAST_FED) for dof in FEEDFORWARD_DOFS)
        self._blocks: deque[_Block] = deque(maxlen=round(WINDOW_S / BLOCK_S))
        self._block = _Block()
        self._before: Six | None = None
        self._since = ""

    def step(
        self,
        dt_s: float,
        coefficients: Mapping[str, float],
        hull: Mapping[str, float],
        given: Six,
        fed: Six,
        nu: Six,
    ) -> None:
        """Add a tick of `dt_s` in shadow: `given` is the wrench that the thrusters were asked for, `fed` the wrench
        that the feed-forward would have given (N and N m), `nu` the velocity that the controller used (m/s and
        rad/s)."""
        if not all(math.isfinite(nu[dof]) for dof in FEEDFORWARD_DOFS):
            self.begin_anew("a bad reading")
            return
        if not 0 < dt_s <= LONGEST_TICK_S:
            self.pause()
        before, self._before = self._before, nu
        if before is None:
            return
        # An axis without a measurement, heave for example, does not affect the three judged axes.
        change = [
            (now - then) / dt_s if math.isfinite(now - then) else 0.0
            for now, then in zip(nu, before, strict=True)
        ]
        made = Reference(nu, (change[0], change[1], change[2], change[3], change[4], change[5]), 0.0, 0.0)
        predicted = feedforward(coefficients, made, UNLIMITED, hull).tau
        block = self._block
        block.seconds += dt_s
        for axis, dof in enumerate(FEEDFORWARD_DOFS):
            block.given[axis] += given[dof] * dt_s
            block.predicted[axis] += predicted[dof] * dt_s
            block.fed[axis] += abs(fed[dof]) * dt_s
        if block.seconds >= BLOCK_S - 0.5 * dt_s:
            self._blocks.append(block)
            self._block = _Block()

    def pause(self) -> None:
        """Leave shadow for now: complete blocks stay, the unfinished block of 2 s is dropped."""
        self._block, self._before = _Block(), None

    def begin_anew(self, since: str = "") -> None:
        """Drop all blocks. `since` gives the reason in at most 20 characters; it is kept only if shadow had already
        been flown."""
        self._since = since if self._blocks or self._before or self._since else ""
        self.pause()
        self._blocks.clear()

    @property
    def fault(self) -> str:
        """Why shadow has not been good, in at most 50 characters; "" if it has."""
        flown_s = BLOCK_S * len(self._blocks)
        if len(self._blocks) < (self._blocks.maxlen or 0):
            if not (self._blocks or self._before or self._since):
                return NONE_FLOWN
            since = f" since {self._since}" if self._since else ""
            return f"shadow: {flown_s:.0f} of {WINDOW_S:.0f} s flown{since}"
        judged = [axis for axis in range(len(FEEDFORWARD_DOFS)) if self._moved_s(axis) >= MOVED_S]
        if not judged:
            return f"shadow: no axis moved for {MOVED_S:.0f} of {WINDOW_S:.0f} s"
        share, axis = min((self._explained(axis), axis) for axis in judged)
        if share >= LEAST_EXPLAINED:
            return ""
        least, word = 100 * LEAST_EXPLAINED, DOFS[FEEDFORWARD_DOFS[axis]]
        # Rounded down: a share that just misses must not read as what is needed.
        percent = math.floor(100 * max(share, 0.0) + 1e-9)
        return f"shadow: {percent} % of {word} explained, needs {least:.0f}"

    def _moved_s(self, axis: int) -> float:
        return BLOCK_S * sum(
            block.fed[axis] >= self._least_fed[axis] * block.seconds for block in self._blocks
        )

    def _explained(self, axis: int) -> float:
        """Share of the force that the model explains: 1 is all of it; below 0 the model is worse than none."""
        left = sum((block.given[axis] - block.predicted[axis]) ** 2 for block in self._blocks)
        whole = sum(block.given[axis] ** 2 for block in self._blocks)
        return 1 - left / whole if whole > 0 else -math.inf
