"""ArduSub's mixer: the pilot's sticks to a wrench in surge, sway and yaw, a wrench to sticks, and heave beside it.

MANUAL_CONTROL's x, y and r times the joystick's gain are the inputs of the mixer, 1 in full; output n is
1500 + 400 times the sum of its factors times the inputs (libraries/AP_Motors/AP_Motors6DOF.cpp, ArduSub/joystick.cpp
of 4.5). Sums beyond 1 are cut off in the frame vectored, each by itself, and scaled down together in vectored_6dof;
each thruster's thrust is the vehicle file's.
"""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.errors import ConfigError
from bridge.firmware.ardusub import FRAME, FRAMES, MOTOR_FACTORS, SCALES_TOGETHER, whole_number, wiring
from bridge.vehicle.coefficients import HEAVE
from bridge.vehicle.config import Configuration, VehicleFile
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS
from bridge.vehicle.thrusters import NEUTRAL_US, Curve, Pulses, allocation_matrix

SPAN_US: Final = 400.0
LEAST_SHARE: Final = 0.005
"""Below this share of full thrust the inverse runs straight to zero instead of over the dead zone."""

ROUNDS: Final = 4
MOST_MENDED: Final = 0.1
"""Share of the wrench that a round may ask for in addition: a thrust inside the dead zone is not to be had."""


class Mixer:
    """The horizontal part of a frame, with the thrusters of a vehicle file in the frame's order.

    `directions` are the MOT_n_DIRECTION, `motors` the motor, from 1, of each output if that is not the one of its own
    number. `scales_together`: outputs beyond full thrust are scaled down together, not each cut off. `matrix` (3, n):
    wrench in surge, sway and yaw per newton of each driven motor; `inverse` (n, 3): their thrusts per unit of wrench.
    Raises ConfigError if the vehicle file's thrusters push otherwise than the frame takes them to.
    """

    def __init__(
        self,
        frame: int,
        directions: Sequence[float],
        configuration: Configuration,
        curve: Curve,
        motors: Sequence[int] = (),
    ) -> None:
        driven = [motor - 1 for motor in motors] or list(range(len(directions)))
        turned = np.array(directions)[driven]
        factors = np.array(MOTOR_FACTORS[frame], dtype=float)[driven] * turned[:, None]
        self._driven = np.abs(factors).sum(axis=1) > 0
        self._factors = factors[self._driven]
        self._curve = curve
        self.scales_together = frame in SCALES_TOGETHER
        self._whole = allocation_matrix(configuration)
        self.matrix = self._whole[list(FEEDFORWARD_DOFS)][:, self._driven]
        self.inverse: Array = np.asarray(np.linalg.pinv(self.matrix))
        self._unmix = np.linalg.pinv(self._factors)
        limit_n = min(configuration.thruster_limit_n, curve.max_n, -curve.min_n)
        self._pulses = Pulses(curve, LEAST_SHARE * limit_n)
        # Every vertical thruster of these frames has the factor 1 downwards.
        self._down = turned[~self._driven]
        self._sinks = self._whole[HEAVE, ~self._driven]
        effect = self.matrix @ self._factors
        across = np.abs(effect - np.diag(np.diag(effect))).max()
        rises = (self._sinks * self._down).min() <= 0
        if rises or np.diag(effect).min() <= 0 or across > 0.1 * np.diag(effect).min():
            raise ConfigError(
                "the thrusters of the vehicle file do not push as ArduSub's frame takes them to: make the file anew by "
                "seatrial vehicle guess, or mend SERVOn_FUNCTION and MOT_n_DIRECTION"
            )

    @property
    def driven(self) -> list[tuple[int, Array]]:
        """Each motor, from 1, that surge, sway or yaw drives, with its factors (3,)."""
        motors = np.flatnonzero(self._driven) + 1
        return [(int(motor), row) for motor, row in zip(motors, self._factors, strict=True)]

    def wrench(self, inputs: Array) -> Array:
        """Wrench (3,) in surge, sway and yaw, N and N m, of the mixer's inputs (3,)."""
        return np.asarray(self.matrix @ self._thrusts(inputs))

    def _thrusts(self, inputs: Array) -> Array:
        outputs = self._factors @ inputs
        if self.scales_together:
            outputs = outputs / max(1.0, float(np.abs(outputs).max()))
        return self._curve.thrust(NEUTRAL_US + SPAN_US * np.clip(outputs, -1.0, 1.0))

    def whole_wrench(self, inputs: Array, down: float) -> Array:
        """Wrench (6,), N and N m, of the mixer's inputs (3,) and of the input down: all that sticks ask for."""
        thrusts = np.zeros(len(self._driven))
        thrusts[self._driven] = self._thrusts(inputs)
        thrusts[~self._driven] = self._curve.thrust(
            NEUTRAL_US + SPAN_US * np.clip(down * self._down, -1.0, 1.0)
        )
        return np.asarray(self._whole @ thrusts)

    def inputs(self, wrench: Array) -> Array:
        """Inputs (3,) that give a wrench (3,) within the mixer's reach.

        Four thrusters, three inputs: one combination can't be reached, and reverse thrust is weaker. Iterates to make
        up for both.
        """
        aim, most = wrench, MOST_MENDED * float(np.abs(wrench).max())
        best, least = np.zeros(3), float("inf")
        for _ in range(ROUNDS):
            pulses = self._pulses(self.inverse @ aim)
            inputs = np.asarray(self._unmix @ ((pulses - NEUTRAL_US) / SPAN_US))
            error = wrench - self.wrench(inputs)
            # Near the dead zone a round may overshoot.
            if (size := float(np.abs(error).max())) < least:
                best, least = inputs, size
            aim = aim + np.clip(error, -most, most)
        return best

    def heave_input(self, force_n: float) -> float:
        """Input downwards that gives a force in heave, N, downwards."""
        thrusts = force_n * self._sinks / float(self._sinks @ self._sinks)
        return float(np.mean((self._pulses(thrusts) - NEUTRAL_US) / SPAN_US * self._down))

    def wrench_of_pulses(self, pwm_us: Sequence[float]) -> Array:
        """Wrench (3,) of the pulses of the frame's outputs."""
        return np.asarray(self.matrix @ self._curve.thrust(np.array(pwm_us)[self._driven]))


def check_rest(file: VehicleFile) -> None:
    """Raises ConfigError for a vehicle whose thrusters rest at another pulse than ArduSub's output 0."""
    neutral_us = file.vehicle.thrust_curve.neutral_us
    if neutral_us != NEUTRAL_US:
        raise ConfigError(
            f"{file.path}: thrust_curve: neutral_us is {neutral_us:g}, and ArduSub holds a thruster at rest by "
            f"{NEUTRAL_US:g} us alone; set the speed controllers to that, and give their curve with it"
        )


def mixer_of(values: Mapping[str, float], shape: Configuration, curve: Curve) -> Mixer:
    """The mixer of an autopilot with these parameters, its FRAME_CONFIG among them, for a vehicle file's thrusters.

    Raises ConfigError for a wiring that can't be read, or thrusters that push otherwise than the frame takes them to.
    """
    number, count = whole_number(values, FRAME, missing=-1), len(shape.thrusters)
    if number not in MOTOR_FACTORS:
        raise ConfigError(f"{FRAME} {number} is not supported: 1 (vectored) and 2 (vectored_6dof) are")
    wired = wiring(values, {FRAMES[number]: count})
    directions = [-1.0 if motor in wired.reversed else 1.0 for motor in range(1, count + 1)]
    return Mixer(number, directions, shape, curve, wired.motors)
