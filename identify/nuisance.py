"""Fitted quantities of an axis other than its coefficients: disturbance, trim and noise of its sensors."""

from dataclasses import dataclass
from enum import Enum

from bridge.vehicle.coefficients import DOFS

WRITTEN = {"n": "N", "nm": "N m", "s": "s", "m_s": "m/s", "rad_s": "rad/s", "m": "m", "rad": "rad"}
"""The units of these quantities as the names of a file have them, and as a reader does."""


class Quantity(Enum):
    """The kind of a fitted quantity; the value is its part of the name."""

    DISTURBANCE = "disturbance_std"
    TIME_CONSTANT = "disturbance_time_constant"
    TRIM = "trim"
    NOISE = "noise_std"


@dataclass(frozen=True)
class Nuisance:
    """A fitted quantity of an axis, `surge` to `yaw`. unit: a key of `WRITTEN`; channel: the sensor of a NOISE."""

    axis: str
    quantity: Quantity
    unit: str
    channel: str = ""

    @property
    def name(self) -> str:
        """As a file has it: `surge_dvl_noise_std_m_s`."""
        return "_".join(filter(None, (self.axis, self.channel, self.quantity.value, self.unit)))


def disturbance(dof: int) -> Nuisance:
    """Standard deviation of an axis's disturbance, N or N m."""
    return Nuisance(DOFS[dof], Quantity.DISTURBANCE, _force(dof))


def time_constant(dof: int) -> Nuisance:
    """Time constant of an axis's disturbance, s."""
    return Nuisance(DOFS[dof], Quantity.TIME_CONSTANT, "s")


def trim(dof: int) -> Nuisance:
    """Constant force or moment of an axis, N or N m."""
    return Nuisance(DOFS[dof], Quantity.TRIM, _force(dof))


def noise(dof: int, channel: str, of_place: bool) -> Nuisance:
    """Standard deviation of a sensor's noise in an axis: of a depth or an angle (`of_place`), else of a velocity."""
    place, velocity = ("m", "m_s") if dof < 3 else ("rad", "rad_s")
    return Nuisance(DOFS[dof], Quantity.NOISE, place if of_place else velocity, channel)


def _force(dof: int) -> str:
    return "n" if dof < 3 else "nm"
