"""Plants effects in the water and on a tether, in other forms than the library's."""

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import GRAVITY_M_S2
from identify.challenge.site import Planted, Site, sized
from identify.challenge.vehicles import DrawnVehicle

Array = NDArray[np.float64]


def _lines(
    rng: np.random.Generator, time_s: Array, low_s: float, high_s: float, count: int
) -> tuple[Array, Array]:
    """A sum of `count` sines with drawn periods and variance 1, and its time derivative; (n,) each."""
    value, rate = np.zeros_like(time_s), np.zeros_like(time_s)
    for period in rng.uniform(low_s, high_s, count):
        omega, phase = 2 * np.pi / period, rng.uniform(0, 2 * np.pi)
        value += np.sqrt(2 / count) * np.sin(omega * time_s + phase)
        rate += np.sqrt(2 / count) * omega * np.cos(omega * time_s + phase)
    return value, rate


def steady_current(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """A current that varies slowly by a tenth of its speed."""
    speed, angle = sized(0.012, size), rng.uniform(-np.pi, np.pi)
    north, east = float(speed * np.cos(angle)), float(speed * np.sin(angle))

    def apply(site: Site, rng: np.random.Generator) -> None:
        water = site.moving_water()
        for column, mean in ((0, north), (1, east)):
            value, rate = _lines(rng, site.time_s, 200.0, 600.0, 3)
            water[:, column] += mean + 0.1 * speed * value
            water[:, 3 + column] += 0.1 * speed * rate

    return Planted("steady_current", {"north": north, "east": east}, apply, size)


def varying_current(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """Currents north and east that each beat within a narrow band of periods, independently."""
    amplitude, period = sized(0.01, size), float(np.exp(rng.uniform(np.log(20.0), np.log(150.0))))

    def apply(site: Site, rng: np.random.Generator) -> None:
        water = site.moving_water()
        for column in (0, 1):
            value, rate = _lines(rng, site.time_s, 0.85 * period, 1.15 * period, 5)
            water[:, column] += amplitude / np.sqrt(2) * value
            water[:, 3 + column] += amplitude / np.sqrt(2) * rate

    return Planted("varying_current", {"amplitude": amplitude, "period": period}, apply, size)


def waves(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A narrow spectrum of deep-water waves whose orbits fade with depth; expressed as the force on a body at rest."""
    speed, period, course = sized(0.006, size), rng.uniform(2.5, 7.0), rng.uniform(-np.pi, np.pi)
    omega = 2 * np.pi / period

    def apply(site: Site, rng: np.random.Generator) -> None:
        water = site.moving_water()
        for share in (0.88, 0.94, 1.0, 1.06, 1.12):
            w, phase = omega * share * rng.uniform(0.99, 1.01), rng.uniform(0, 2 * np.pi)
            cos, sin = np.cos(w * site.time_s + phase), np.sin(w * site.time_s + phase)
            part = speed / np.sqrt(5)
            for column, way in ((6, np.cos(course)), (7, np.sin(course))):
                water[:, column] += part * way * cos
                water[:, 3 + column] -= part * way * w * sin
            water[:, 8] -= part * sin
            water[:, 11] -= part * w * cos
        site.hull = site.hull._replace(wave_number=omega**2 / GRAVITY_M_S2, wave_ref=site.depth_m)

    force = float((vehicle.mass[0]) * omega * speed)
    return Planted("waves", {"force_amplitude": force, "period": period}, apply, size)


def free_surface(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """Added mass that falls off exponentially below the surface."""
    more = sized(0.15, size)

    def apply(site: Site, _: np.random.Generator) -> None:
        site.hull = site.hull._replace(surface=more, surface_m=0.45)

    return Planted("free_surface", {"mass_change": 0.6 * more}, apply, size, needs="shallow")


def bottom_or_wall(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """Added mass that falls off as the cube of the altitude, as of a sphere at a wall (Lamb 1932, article 99)."""
    more = sized(0.15, size)

    def apply(site: Site, _: np.random.Generator) -> None:
        site.hull = site.hull._replace(bottom=more, bottom_m=0.5)

    return Planted("bottom_or_wall", {"mass_change": 0.6 * more}, apply, size, needs="low")


def tether(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A line that stiffens as it is drawn out, as a catenary does, from an anchor a few metres away."""
    grip = sized(0.06, size) * vehicle.share
    far, angle = rng.uniform(1.0, 5.0), rng.uniform(-np.pi, np.pi)
    north, east = float(far * np.cos(angle)), float(far * np.sin(angle))

    def apply(site: Site, _: np.random.Generator) -> None:
        site.hull = site.hull._replace(grip=grip, slack_m=6.0, anchor_n=north, anchor_e=east)

    stiff = grip * (1.0 + (far / 6.0) ** 2)
    parameters = {"stiffness": stiff, "north": stiff * north, "east": stiff * east}
    return Planted("tether", parameters, apply, size)


ALL = (steady_current, varying_current, waves, free_surface, bottom_or_wall, tether)
