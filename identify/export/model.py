"""`Model`: all known dynamics of a vehicle, to be written for another simulator; conversion of axes, and XML.

M nu_dot + C(nu) nu + (D + D_q |nu|) nu + g(eta) = tau, with diagonal M, D and D_q about the origin (Fossen 2011, eqs
6.1 to 6.3). Unknown values are zero; unknown masses and dampings are named.

Body FRD, earth NED. A rotation by 180 degrees about x takes FRD to FLU: y and z change sign, and so do the moments and
rates about them; diagonal matrices stay the same.
"""

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from bridge.arrays import Vector3
from bridge.errors import ConfigError
from bridge.vehicle.coefficients import COEFFICIENTS, DAMPINGS, DOFS, MASSES, QUADRATICS
from bridge.vehicle.config import GRAVITY_M_S2, Configuration, ThrustCurve, VehicleFile
from bridge.vehicle.references import Six
from bridge.vehicle.thrusters import thrust_curve

KNOW = "identify it, or put it into the vehicle file's model"

NONE: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
CURVE_US = range(1100, 1901, 10)
"""Pulse widths at which the thrust curve is written."""
DRAG_SPEED_M_S = 0.5
"""Speed, m/s or rad/s, at which drag is right in a simulator whose drag grows with another power of it."""


@dataclass(frozen=True)
class Propeller:
    """A thruster: position and direction of positive thrust (FRD, from the origin), and its response to a command.

    For a command T within `low_n` and `high_n` it gives gain * T, times `reverse_gain` astern, less `dead_zone_n` on
    either side of zero, and nothing if |T| is below `least_n`.
    """

    direction: Vector3
    position_m: Vector3
    low_n: float
    high_n: float
    gain: float = 1.0
    reverse_gain: float = 1.0
    dead_zone_n: float = 0.0
    least_n: float = 0.0

    def thrust_n(self, asked_n: float) -> float:
        """Steady thrust, N: after the lag."""
        held = min(max(asked_n, self.low_n), self.high_n)
        left = max(abs(held) - self.dead_zone_n, 0.0) * self.gain if abs(held) >= self.least_n else 0.0
        return left if held > 0 else -left * self.reverse_gain


@dataclass(frozen=True)
class Model:
    """A vehicle's dynamics in SI units.

    `inertia_kgm2`: rigid body, about x y z. `added`: added mass and inertia, positive if it makes the vehicle
    heavier. `linear` and `quadratic`: damping, positive if it brakes: N/(m/s) and N m/(rad/s), N/(m/s)2 and N
    m/(rad/s)2. `lag_s`: first-order lag of every thruster. `net_buoyancy_n`: buoyancy minus weight.
    `centre_of_gravity_m`, `centre_of_buoyancy_m`: from the origin, FRD. `current_m_s`: velocity of the water, NED.
    `curve`: thrust (N) over pulse width (us) before gains. `forward_n_s2`: T = k n |n| with n in rev/s. `intervals`:
    known 95 % intervals by coefficient. `unheld`: accepted effects that have no place here. `notes`: what a reader
    must know of these values, whatever the target. `unknown`: masses and dampings of which nothing is known; their
    values are the rigid body's own, and zero.
    """

    name: str
    dry_mass_kg: float
    inertia_kgm2: Vector3
    added: Six
    linear: Six
    quadratic: Six = NONE
    thrusters: tuple[Propeller, ...] = ()
    lag_s: float = 0.0
    net_buoyancy_n: float = 0.0
    centre_of_gravity_m: Vector3 = (0.0, 0.0, 0.0)
    centre_of_buoyancy_m: Vector3 = (0.0, 0.0, 0.0)
    current_m_s: Vector3 = (0.0, 0.0, 0.0)
    density_kg_m3: float = 1000.0
    curve: tuple[tuple[float, float], ...] = ()
    forward_n_s2: float = ThrustCurve.forward_n_s2
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    unheld: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()

    @property
    def rigid(self) -> Six:
        """Mass and inertia of the rigid body."""
        m, (x, y, z) = self.dry_mass_kg, self.inertia_kgm2
        return m, m, m, x, y, z

    @property
    def total(self) -> Six:
        """Rigid body plus added mass."""
        a, b, c, d, e, f = (r + more for r, more in zip(self.rigid, self.added, strict=True))
        return a, b, c, d, e, f

    @property
    def mean_mass_kg(self) -> float:
        """Mean of the known total masses along x, y and z, for a simulator with a single mass for all directions; the
        dry mass if none is known.
        """
        known = self._known_masses_kg
        return sum(known) / len(known) if known else self.dry_mass_kg

    @property
    def mean_mass_words(self) -> str:
        """Describe `mean_mass_kg` in words."""
        known = len(self._known_masses_kg)
        description = {0: "the dry mass, for none is known", 3: "the mean"}.get(
            known, "the mean of what is known"
        )
        return f"{description}, {self.mean_mass_kg:.4g} kg"

    @property
    def undamped(self) -> tuple[int, ...]:
        """Degrees of freedom without known damping, linear or quadratic."""
        return tuple(c.dof for c in DAMPINGS if c.name in self.unknown and not self.quadratic[c.dof])

    @property
    def _known_masses_kg(self) -> list[float]:
        return [self.total[c.dof] for c in MASSES[:3] if c.name not in self.unknown]

    @property
    def buoyancy_n(self) -> float:
        """Weight of the displaced water."""
        return self.dry_mass_kg * GRAVITY_M_S2 + self.net_buoyancy_n


def volume_m3(model: Model, mass_kg: float) -> float:
    """Volume of a body of `mass_kg` with the model's net buoyancy. Raises ConfigError if it would displace no water."""
    volume = (mass_kg + model.net_buoyancy_n / GRAVITY_M_S2) / model.density_kg_m3
    if volume <= 0:
        raise ConfigError(
            f"{model.name}: with {model.net_buoyancy_n:g} N of net buoyancy its {mass_kg:g} kg displace no water; "
            "correct net_buoyancy_n"
        )
    return volume


def model_of(
    values: Mapping[str, float],
    file: VehicleFile,
    configuration: str,
    intervals: Mapping[str, tuple[float, float]] | None = None,
) -> Model:
    """Model of a configuration with identified `values`; missing values come from the `model` in the vehicle file.

    A value missing there too is listed in `unknown`, and the notes say so. Raises ConfigError if a thrust table can't
    be read.
    """
    shape = file.vehicle.configurations[configuration]
    curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
    known, notes = _known(values, shape)
    totals = six([known.get(c.name, shape.rigid_body(c.dof)[0]) for c in MASSES])
    damping = six([known.get(c.name, 0.0) for c in DAMPINGS])
    added = six([total - shape.rigid_body(dof)[0] for dof, total in enumerate(totals)])
    for dof, more in enumerate(added):
        if more < 0:
            notes.append(
                f"{MASSES[dof].name} lies {-more:.3g} {MASSES[dof].unit} below the rigid body's own, so the added "
                f"{'mass' if dof < 3 else 'inertia'} in {DOFS[dof]} is negative: check the vehicle file"
            )
    arm_nm = shape.centre_of_gravity_below_buoyancy_m * shape.dry_mass_kg * GRAVITY_M_S2
    up_n = shape.dry_mass_kg * GRAVITY_M_S2 + shape.net_buoyancy_n
    high_n, low_n = min(shape.thruster_limit_n, curve.max_n), max(-shape.thruster_limit_n, curve.min_n)
    return Model(
        name=file.vehicle.name,
        dry_mass_kg=shape.dry_mass_kg,
        inertia_kgm2=shape.inertia_kgm2,
        added=added,
        linear=damping,
        quadratic=six([known.get(c.name, 0.0) for c in QUADRATICS]),
        thrusters=tuple(Propeller(t.direction, t.position_m, low_n, high_n, t.gain) for t in shape.thrusters),
        lag_s=file.vehicle.thrust_curve.lag_s,
        net_buoyancy_n=shape.net_buoyancy_n,
        # As in the nominal model, the weight acts at the origin; the righting moment is the same.
        centre_of_buoyancy_m=(0.0, 0.0, -arm_nm / up_n if up_n else 0.0),
        density_kg_m3=file.vehicle.water.density_kg_m3,
        curve=tuple((float(us), float(curve.thrust(us))) for us in CURVE_US) if shape.thrusters else (),
        forward_n_s2=file.vehicle.thrust_curve.forward_n_s2,
        intervals=dict(intervals or {}),
        notes=tuple(notes),
        unknown=tuple(c.name for c in COEFFICIENTS if c.name not in known),
    )


def _known(values: Mapping[str, float], shape: Configuration) -> tuple[dict[str, float], list[str]]:
    """Masses and drags, identified or else from the vehicle file, and a note on each that was not identified.

    Quadratic drag of the file is of no use beside a linear one that was identified: the two make one drag together.
    """
    known, notes = {}, []
    squared = {DAMPINGS[c.dof].name: c.name for c in QUADRATICS if c.name in values}
    for name in (c.name for c in COEFFICIENTS):
        if name in values:
            known[name] = values[name]
        elif name in squared:
            known[name] = 0.0
            notes.append(f"{name} was not identified: {squared[name]} is all the drag there")
        elif name in shape.model:
            known[name] = shape.model[name]
            notes.append(f"{name} was not identified: {shape.model[name]:g} is the vehicle file's own")
        else:
            notes.append(f"{name} was not identified and the vehicle file's model has none: it is unknown")
    for c in QUADRATICS:
        if c.name in values:
            known[c.name] = values[c.name]
        elif c.name in shape.model and DAMPINGS[c.dof].name not in values:
            known[c.name] = shape.model[c.name]
            notes.append(f"{c.name} was not identified: {known[c.name]:g} is the vehicle file's own")
    return known, notes


def six(values: list[float]) -> Six:
    a, b, c, d, e, f = map(float, values)
    return a, b, c, d, e, f


def flu(frd: Vector3) -> Vector3:
    """Convert a vector from forward, right, down to forward, left, up."""
    x, y, z = frd
    return x + 0.0, 0.0 - y, 0.0 - z


def enu(ned: Vector3) -> Vector3:
    """Convert a vector from north, east, down to east, north, up."""
    north, east, down = ned
    return east + 0.0, north + 0.0, 0.0 - down


def pointing(direction: Vector3) -> Vector3:
    """Roll, pitch and yaw (rad; Rz(yaw) Ry(pitch) Rx(roll)) that turn the x axis to `direction`, of any length."""
    x, y, z = direction
    return 0.0, math.atan2(0.0 - z, math.hypot(x, y)), math.atan2(y, x)


def number(value: float) -> str:
    """Shortest text that reads back as the same number; no negative zero."""
    return repr(float(value) + 0.0)


def numbers(values: Iterable[float]) -> str:
    return " ".join(number(value) for value in values)


def element(parent: ET.Element, tag: str, text: str | float = "", **attributes: str) -> ET.Element:
    child = ET.SubElement(parent, tag, attributes)
    words = text if isinstance(text, str) else number(text)
    if words:
        child.text = words
    return child


def comment(parent: ET.Element, model: Model, sentence: str) -> None:
    """Add a comment with the file's purpose, the unknown values, and the intervals, for which XML has no element."""
    intervals = ", ".join(f"{name} {low:.4g} to {high:.4g}" for name, (low, high) in model.intervals.items())
    words = f"{model.name}: {sentence}"
    words += f" Unknown: {', '.join(model.unknown)}." if model.unknown else ""
    words += f" 95 % intervals: {intervals}." if intervals else ""
    parent.append(ET.Comment(f" {re.sub('-(?=-)', '- ', words)} "))


def document(root: ET.Element) -> str:
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
