"""Manoeuvres of a plan: the steps of a mission, and how a pilot would do the same by hand.

Surge and sway are pushed: the thrusters hold a force, as a stick does. Heave and yaw follow a rate through the
controller, which keeps depth and heading. A square wave begins and ends with a quarter of its period, so that
velocity and position swing about zero from the start.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from bridge.simulator.missions import TRANSIENT_S
from bridge.vehicle.coefficients import DOFS, HEAVE, SURGE, SWAY, YAW
from bridge.vehicle.legs import Leg

PUSHES = {SURGE: "push_surge_n", SWAY: "push_sway_n"}
RATES = {SURGE: "surge_m_s", SWAY: "sway_m_s", HEAVE: "heave_m_s", YAW: "yaw_rad_s"}
UNITS = {"push_surge_n": "N", "push_sway_n": "N", "yaw_rad_s": "rad/s"}
WAYS = {
    SURGE: ("ahead", "astern"),
    SWAY: ("right", "left"),
    HEAVE: ("down", "up"),
    YAW: ("turning right", "turning left"),
}

PERIODS_S = (4.0, 8.0, 16.0, 32.0)
"""In a faster wave the lag of the thrusters would matter as much as the mass."""

SWEEP_S = (16.0, 8.0, 8.0, 4.0, 4.0, 4.0, 4.0)
BLOCK_S = 32.0
LAP_REST_S = 3.0


@dataclass(frozen=True)
class Drive:
    """Excitation of an axis: the key in a mission's step, and the amplitude (N, m/s or rad/s) at scale 1."""

    dof: int
    key: str
    amplitude: float

    @property
    def unit(self) -> str:
        return UNITS.get(self.key, "m/s")


@dataclass(frozen=True)
class Manoeuvre:
    """A manoeuvre to dive. `amplitudes` belong to `drives`; `by_hand` says how a pilot does it."""

    kind: str
    drives: tuple[Drive, ...]
    amplitudes: tuple[float, ...]
    period_s: float
    steps: tuple[Leg, ...]
    by_hand: str

    @property
    def duration_s(self) -> float:
        return sum(step.duration_s * step.alternate for step in self.steps)

    @property
    def dofs(self) -> tuple[int, ...]:
        return tuple(drive.dof for drive in self.drives)

    @property
    def name(self) -> str:
        return f"{' and '.join(DOFS[dof] for dof in self.dofs)}: {self.kind}"

    @property
    def sentence(self) -> str:
        """Kind, strength, period and duration; rates of turn in degrees, for a crew."""
        strength = " and ".join(
            f"±{math.degrees(amplitude):.3g} deg/s" if drive.dof == YAW else f"±{amplitude:.3g} {drive.unit}"
            for drive, amplitude in zip(self.drives, self.amplitudes, strict=True)
        )
        return f"{self.name} {strength}, {self.period_s:g} s period, {self.duration_s:g} s"

    def legs(self) -> list[Leg]:
        return [leg for step in self.steps for leg in step.expanded()]


@dataclass(frozen=True)
class Family:
    """A manoeuvre of any strength and length: `build(amplitudes, cycles)` gives its steps and how to do it by hand."""

    kind: str
    drives: tuple[Drive, ...]
    period_s: float
    build: Callable[[dict[str, float], int], tuple[list[Leg], str]]

    @property
    def cycles(self) -> int:
        """Number of cycles that comes nearest to a block of time."""
        return max(1, round(BLOCK_S / self.period_s))

    def at(self, scale: float, cycles: int) -> Manoeuvre:
        """The manoeuvre at a share of its full strength."""
        amplitudes = tuple(_rounded(scale * drive.amplitude) for drive in self.drives)
        keyed = {drive.key: amplitude for drive, amplitude in zip(self.drives, amplitudes, strict=True)}
        steps, by_hand = self.build(keyed, cycles)
        return Manoeuvre(self.kind, self.drives, amplitudes, self.period_s, tuple(steps), by_hand)


def square(period_s: float, *drives: Drive) -> Family:
    """To and fro at full strength, all drives together."""

    def build(amplitudes: dict[str, float], cycles: int) -> tuple[list[Leg], str]:
        name = f"{' and '.join(DOFS[drive.dof] for drive in drives)} square wave"
        return _wave(name, amplitudes, period_s, cycles), _wave_by_hand(drives, period_s, cycles)

    return Family("square wave", drives, period_s, build)


def sweep(drive: Drive) -> Family:
    """Square waves with decreasing periods."""

    def build(amplitudes: dict[str, float], cycles: int) -> tuple[list[Leg], str]:
        steps = [
            step
            for _ in range(cycles)
            for period_s in dict.fromkeys(SWEEP_S)
            for step in _wave(f"{DOFS[drive.dof]} sweep", amplitudes, period_s, SWEEP_S.count(period_s))
        ]
        ahead, astern = WAYS[drive.dof]
        waves = ", ".join(f"{SWEEP_S.count(p)} of {p:g} s" for p in dict.fromkeys(SWEEP_S))
        return steps, (
            f"{ahead} and {astern} in turn, in whole periods: {waves}, each begun and ended with a quarter period "
            f"{ahead}; {cycles} times"
        )

    return Family("sweep", (drive,), sum(SWEEP_S), build)


def coast_down(period_s: float, drive: Drive) -> Family:
    """Push up to speed, then no thrust at all, so that drag alone slows the vehicle; then the same backwards."""

    def build(amplitudes: dict[str, float], cycles: int) -> tuple[list[Leg], str]:
        part_s, force = period_s / 4, amplitudes[drive.key]
        name = f"{DOFS[drive.dof]} coast-down"
        thrust, coast = Leg(part_s, name, "acceleration"), Leg(part_s, name, "deceleration")
        once = [
            step
            for way in (force, -force)
            for step in (_driven(thrust, {drive.key: way}), _driven(coast, {drive.key: 0.0}))
        ]
        ahead, astern = WAYS[drive.dof]
        return once * cycles, (
            f"{ahead} for {part_s:g} s, no thrust for {part_s:g} s, {astern} for {part_s:g} s, no thrust for "
            f"{part_s:g} s; {cycles} times"
        )

    return Family("coast-down", (drive,), period_s, build)


def laps(length: float, drive: Drive) -> Family:
    """There and back over a length in m, or an angle in rad, at a steady velocity, with double-S transients."""
    steady_s = max(round(length / drive.amplitude - TRANSIENT_S, 1), 0.1)
    period_s = 2 * (2 * TRANSIENT_S + steady_s + LAP_REST_S)

    def build(amplitudes: dict[str, float], cycles: int) -> tuple[list[Leg], str]:
        name = f"{DOFS[drive.dof]} laps"
        once = []
        for way in (1.0, -1.0):
            wanted = {drive.key: way * amplitudes[drive.key]}
            once += [
                _driven(Leg(TRANSIENT_S, name, "acceleration", transient_s=TRANSIENT_S), wanted),
                _driven(Leg(steady_s, name), wanted),
                Leg(TRANSIENT_S, name, "deceleration", transient_s=TRANSIENT_S),
                Leg(LAP_REST_S, name, "rest"),
            ]
        ahead, astern = WAYS[drive.dof]
        return once * cycles, (
            f"{ahead}: {TRANSIENT_S:g} s to get to speed, {steady_s:g} s steady, {TRANSIENT_S:g} s to stop, "
            f"{LAP_REST_S:g} s at rest; {astern} the same; {cycles} times"
        )

    return Family("laps", (drive,), period_s, build)


def _wave(name: str, amplitudes: dict[str, float], period_s: float, cycles: int) -> list[Leg]:
    back = {key: -value for key, value in amplitudes.items()}
    quarter, halves = Leg(period_s / 4, name), Leg(period_s / 2, name, alternate=2 * cycles - 1)
    return [_driven(quarter, amplitudes), _driven(halves, back), _driven(quarter, amplitudes)]


def _driven(step: Leg, amplitudes: dict[str, float]) -> Leg:
    return replace(step, **amplitudes)  # type: ignore[arg-type]


def _wave_by_hand(drives: tuple[Drive, ...], period_s: float, cycles: int) -> str:
    ahead = " and ".join(WAYS[drive.dof][0] for drive in drives)
    astern = " and ".join(WAYS[drive.dof][1] for drive in drives)
    return (
        f"{ahead} for {period_s / 4:g} s; {astern}, then {ahead}, in turn for {period_s / 2:g} s each, "
        f"{2 * cycles - 1} times in all, {astern} first and last; {ahead} for {period_s / 4:g} s"
    )


def _rounded(value: float) -> float:
    """Round to three digits, which a crew can read out."""
    return float(f"{value:.3g}")
