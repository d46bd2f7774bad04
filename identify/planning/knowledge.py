"""Knowledge of a vehicle before a dive, and the Fisher information that a motion would add to it.

An axis M nu_dot + D nu = F + d with a coloured force d and noisy readings of nu responds to a change of log M by -M j
w V / Z and to a change of log D by -D V / Z, with V the spectrum of its velocity and Z = M j w + D. The information
is the sum of the squared response over the spectrum of the readings without that response, S = N + S_d / |Z|^2
(Whittle 1953; Ljung 1999, eq. 9.54), so

    J_MM = sum w^2 M^2 |V|^2 / (|Z|^2 N + S_d),    J_DD = sum D^2 |V|^2 / (|Z|^2 N + S_d),

and mass and damping are separable at every frequency, being in quadrature. The trim force takes the mean. The
coupling forces between axes count as known, and so do noise levels, whose information is independent.

If the vehicle file gives a hull linear and quadratic drag, both are to be known: a change of log D2 gives
-D2 W / Z, with W the spectrum of |v| v, which resembles that of the linear drag so much that a dive at one speed leaves
each of them several times as wide. There Z has the slope of the whole drag at the usual speed.

Later thrust gives the response -j w V / (1 + j w L), behind the last part of a lag L. No dive can separate the part
of that response that resembles the ones of mass and damping.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.errors import ConfigError
from bridge.simulator.truth import DISTURBANCE_N_PER_KG, TYPICAL
from bridge.vehicle.coefficients import BY_NAME, COEFFICIENTS, DAMPINGS, MASSES, OF_HULL, QUADRATICS
from bridge.vehicle.config import Configuration, Sensors, VehicleFile
from bridge.vehicle.parameters import bounds
from identify.estimators.timing.lateness import LATER_S
from identify.identification import Identification
from identify.nuisance import disturbance, noise, time_constant

Complex = NDArray[np.complexfloating[Any, Any]]
NAMES = tuple(coefficient.name for coefficient in COEFFICIENTS)
COUNTED = (*NAMES, *(coefficient.name for coefficient in QUADRATICS))
"""Coefficients whose information is counted; that of quadratic drag is zero for a hull with linear drag alone."""
MASS_RATIO, DAMPING_RATIO = 1.4, 0.7
"""Total mass and damping as shares of the rigid body's mass or inertia, if the vehicle file gives neither."""

DVL_HZ, DEPTH_HZ, GYRO_HZ, FOG_HZ = 10.0, 10.0, 100.0, 1000.0
LOGGED_HZ = {"gyro": 50.0, "fog": 40.0, "attitude": 20.0}
"""Rates at which the bridge sends the signals that it decimates."""

ROUGH = 0.5
"""A value with a relative standard deviation above this is no better than a guess."""

ROUNDING = 1e-6
"""Tolerance of correlations: of their symmetry, and of eigenvalues below zero, for a covariance written as text."""

FIRM = 0.05
"""Relative standard deviation up to which a value is firm enough to show a narrower interval around it."""

DISTURBANCE_TIME_S = 1.5
ARM_M = 1.0 / 6.0
"""Moment of a disturbance over its force."""


@dataclass(frozen=True)
class AxisNoise:
    """Noise of a degree of freedom, as `likelihood` models it.

    A force or moment of standard deviation `disturbance` (N, N m), first-order coloured with `time_constant_s`; white
    noise on the velocity with density `velocity` ((m/s)^2/Hz, (rad/s)^2/Hz), and on its integral with density
    `position`, inf if no sensor reads the integral.
    """

    disturbance: float
    time_constant_s: float
    velocity: float
    position: float = math.inf


@dataclass(frozen=True)
class Knowledge:
    """All twelve coefficients by name, quadratic drag where the hull has it, the noise of each degree of freedom, and
    sentences on their sources.

    `precision` (18, 18) is that of the logarithms in the order of `COUNTED`, zero for unknown coefficients. `guessed`
    are coefficients without a prior, and without an identification to within `FIRM`. `doubted`: by coefficient, the
    sentences of the identification that doubt its result or say why it gives none; `doubts` are all of these
    sentences.
    """

    values: dict[str, float]
    precision: Array
    noise: tuple[AxisNoise, ...]
    sentences: tuple[str, ...]
    guessed: frozenset[str] = frozenset()
    doubted: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def doubts(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(sentence for sentences in self.doubted.values() for sentence in sentences))


def before_any_dive(file: VehicleFile, configuration: str) -> Knowledge:
    """Knowledge from the vehicle file; open values are generic ratios to the rigid body's mass."""
    shape = file.vehicle.configurations[configuration]
    values, open_names = {}, []
    precision = np.zeros((len(COUNTED), len(COUNTED)))
    for place, coefficient in enumerate(COEFFICIENTS):
        name, prior = coefficient.name, shape.priors.get(coefficient.name)
        if prior is not None:
            values[name], precision[place, place] = prior.value, (prior.value / prior.std) ** 2
        elif shape.model.get(name, 0.0) > 0:
            values[name] = shape.model[name]
        else:
            open_names.append(name)
            ratio = MASS_RATIO if coefficient.kind == "mass" else DAMPING_RATIO
            values[name] = ratio * shape.rigid_body(coefficient.dof)[0]
    if shape.damping == "both":
        for coefficient in QUADRATICS:
            # Where none is given, as much as the linear drag at 1 m/s or rad/s.
            value = shape.model.get(coefficient.name, 0.0)
            values[coefficient.name] = value if value > 0 else values[DAMPINGS[coefficient.dof].name]
    sentences = [
        "Noise and disturbance are those of a typical vehicle of this mass: a dive tells better, give it by --after."
    ]
    absent = [
        sensor
        for slot, sensor in (("dvl", "DVL"), ("imu", "IMU"))
        if getattr(file.vehicle.sensors, slot) is None
    ]
    if absent:
        sentences.append(
            f"The vehicle file names no {' and no '.join(absent)}: a typical one is taken for granted (beside an "
            "autopilot the IMU is the autopilot's); without it the dive tells nothing."
        )
    if open_names:
        sentences.append(
            f"The vehicle file gives no value above 0 for {', '.join(open_names)}: taken as {MASS_RATIO:g} (mass) and "
            f"{DAMPING_RATIO:g} (damping) times the rigid body's own, which may be far off."
        )
    guessed = frozenset(name for name in NAMES if name not in shape.priors)
    return Knowledge(values, precision, _typical_noise(file, shape), tuple(sentences), guessed)


def after(identified: Mapping[str, Any], file: VehicleFile, configuration: str, source: str) -> Knowledge:
    """Knowledge before any dive plus that of an identification, given as JSON; `source` is named in messages.

    Raises ConfigError if `identified` is not an identification, or belongs to another vehicle or configuration, or
    holds impossible numbers.
    """
    first = before_any_dive(file, configuration)
    shape = file.vehicle.configurations[configuration]
    try:
        said, of_vehicle = str(identified["configuration"]), str(identified["vehicle"]["name"])
        outcome = str(identified["outcome"])
        listed = {p["name"]: p for p in identified["parameters"] if p["name"] in OF_HULL}
        order, matrix = identified["covariance"]["of"], identified["covariance"]["matrix"]
        covariance = np.array(matrix, dtype=np.float64).reshape(len(order), len(order))
        order = [str(name) for name in order]
        nuisance = {str(k): float(v) for k, v in identified["nuisance"].items()}
        values = {name: float(listed[name]["value"]) for name in order if (listed[name]["value"] or 0.0) > 0}
        doubted = _doubted(identified, order)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        why = f"it lacks {error}" if isinstance(error, KeyError) else error
        raise ConfigError(
            f"{source}: not an identification as seatrial identify --json writes it ({why}); give one, or the dive"
        ) from None
    if of_vehicle != file.vehicle.name:
        raise ConfigError(
            f"{source}: is of vehicle '{of_vehicle}', not '{file.vehicle.name}'; give its own file"
        )
    if said != configuration:
        raise ConfigError(
            f"{source}: is of configuration '{said}', not '{configuration}'; name it: --vehicle FILE:{said}"
        )
    known = [i for i, name in enumerate(order) if name in values]
    _check([order[i] for i in known], covariance[np.ix_(known, known)], nuisance, source)
    precision = first.precision.copy()
    firm = frozenset(order[i] for i in known if math.sqrt(covariance[i, i]) <= FIRM * values[order[i]])
    if known:
        places = [COUNTED.index(order[i]) for i in known]
        scale = np.array([values[order[i]] for i in known])
        rough = np.sqrt(np.diag(covariance)[known]) / scale > ROUGH
        _check_possible(
            [order[i] for i, vague in zip(known, rough, strict=True) if not vague and order[i] in BY_NAME],
            values,
            shape,
            source,
        )
        relative = covariance[np.ix_(known, known)] / np.outer(scale, scale)
        precision[np.ix_(places, places)] = np.linalg.pinv(relative, hermitian=True)
        values = {order[i]: values[order[i]] for i, vague in zip(known, rough, strict=True) if not vague}
    left = [name for name in NAMES if name not in values]
    sentences = [f"Starts from {source}, which ended as '{outcome}'."]
    if left:
        are = "its value is" if len(left) == 1 else "their values are"
        sentences.append(
            f"It tells little or nothing of {', '.join(left)}: {are} the vehicle file's or, where that has none, "
            f"{MASS_RATIO:g} (mass) and {DAMPING_RATIO:g} (damping) times the rigid body's own."
        )
    noise = tuple(_noise_of(dof, nuisance, typical, file) for dof, typical in enumerate(first.noise))
    guessed = first.guessed - firm
    return Knowledge({**first.values, **values}, precision, noise, tuple(sentences), guessed, doubted)


def _doubted(identified: Mapping[str, Any], fitted: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Reasons to doubt each coefficient: doubts about it or about what it leans on, and missing readings."""
    reasons_of = [
        ([*map(str, doubt["about"]), *map(str, doubt.get("also") or ())], str(doubt["sentence"]))
        for doubt in identified.get("doubts", ())
    ]
    lacking: dict[str, list[str]] = {}
    for parameter in identified["parameters"]:
        if parameter["name"] in BY_NAME and parameter["name"] not in fitted and parameter.get("reason"):
            lacking.setdefault(str(parameter["reason"]), []).append(str(parameter["name"]))
    reasons_of += [
        (names, f"Of {' and '.join(names)} it told nothing: {reason}.") for reason, names in lacking.items()
    ]
    by_name = {name: tuple(sentence for about, sentence in reasons_of if name in about) for name in NAMES}
    return {name: sentences for name, sentences in by_name.items() if sentences}


def _check(of: Sequence[str], covariance: Array, nuisance: Mapping[str, float], source: str) -> None:
    """Raise ConfigError for numbers that are no covariance of distinct names, or no noise."""
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    proper = len(set(of)) == len(of) and np.isfinite(covariance).all() and (std > 0).all()
    if proper and len(of):
        correlation = covariance / np.outer(std, std)
        proper = (
            np.allclose(correlation, correlation.T, rtol=0.0, atol=ROUNDING)
            and np.linalg.eigvalsh(correlation)[0] >= -ROUNDING
        )
    odd = [name for name, value in nuisance.items() if not math.isfinite(value)]
    if odd or not proper:
        wrong = f"its {odd[0]} is no finite number" if odd else "its covariance is none"
        raise ConfigError(f"{source}: is damaged, for {wrong}; identify the dive again")


def _check_possible(
    names: Sequence[str], values: Mapping[str, float], shape: Configuration, source: str
) -> None:
    """Raise ConfigError for a value that no vehicle of this configuration can have."""
    for name in names:
        low, high = bounds(BY_NAME[name], shape)
        if not low <= values[name] <= high:
            raise ConfigError(
                f"{source}: {name} is {values[name]:g}, and a vehicle like this has {low:g} to {high:g}; "
                "identify the dive again, or check the vehicle file's mass and thrust"
            )


def _rate_hz(sensors: Sensors, slot: str, usual_hz: float) -> float:
    device = getattr(sensors, slot)
    return usual_hz if device is None else device.rate_hz or usual_hz


def _typical_noise(file: VehicleFile, shape: Configuration) -> tuple[AxisNoise, ...]:
    sensors, water = file.vehicle.sensors, file.vehicle.water
    force = DISTURBANCE_N_PER_KG * shape.dry_mass_kg
    dvl = TYPICAL.dvl_m_s**2 / _rate_hz(sensors, "dvl", DVL_HZ)
    depth_m = TYPICAL.pressure_pa / water.weight_n_m3
    gyro_hz = _rate_hz(sensors, "imu", GYRO_HZ)
    gyro, attitude = TYPICAL.gyro_rad_s**2 / gyro_hz, TYPICAL.attitude_rad**2 / gyro_hz
    fog = TYPICAL.fog_rad_s**2 / _rate_hz(sensors, "fog", FOG_HZ)
    linear = AxisNoise(force, DISTURBANCE_TIME_S, dvl)
    heave = replace(linear, position=depth_m**2 / _rate_hz(sensors, "depth", DEPTH_HZ))
    yaw = AxisNoise(force * ARM_M, DISTURBANCE_TIME_S, gyro if sensors.fog is None else min(gyro, fog))
    tilt = AxisNoise(force * ARM_M, DISTURBANCE_TIME_S, gyro, attitude)
    return linear, linear, heave, tilt, tilt, yaw


def _noise_of(dof: int, nuisance: Mapping[str, float], typical: AxisNoise, file: VehicleFile) -> AxisNoise:
    """Noise of an axis according to the identification, or the typical noise if it did not estimate it."""
    sensors = file.vehicle.sensors
    dvl_hz, depth_hz = _rate_hz(sensors, "dvl", DVL_HZ), _rate_hz(sensors, "depth", DEPTH_HZ)
    hz = {"dvl": dvl_hz, "filter": dvl_hz, "depth": depth_hz, **LOGGED_HZ}
    density = {
        name: value**2 / hz[name]
        for name in hz
        for of_place in (False, True)
        if (value := nuisance.get(noise(dof, name, of_place).name)) is not None
    }
    return AxisNoise(
        nuisance.get(disturbance(dof).name, typical.disturbance),
        nuisance.get(time_constant(dof).name, typical.time_constant_s),
        min((density[n] for n in ("dvl", "filter", "gyro", "fog") if n in density), default=typical.velocity),
        min((density[n] for n in ("depth", "attitude") if n in density), default=typical.position),
    )


TELLING_HZ = 5.0
"""Above this frequency a DVL reads nothing, and no vehicle of this size moves."""


def of_motion(step_s: float, nu: Array, knowledge: Knowledge, dofs: tuple[int, ...]) -> Array:
    """Information (18, 18) about log coefficients from the axes `dofs`, moving as `nu` (n, 6) from rest to rest.

    Rows are `step_s` apart; the order is that of `COUNTED`.
    """
    out = np.zeros((len(COUNTED), len(COUNTED)))
    for dof in dofs:
        axis = axis_of(step_s, nu[:, dof], *_drag_and_noise(knowledge, dof))
        places = _places(dof, len(axis.answers))
        out[np.ix_(places, places)] = axis.information(axis.answers)
    return out


def of_timing(step_s: float, nu: Array, knowledge: Knowledge, dofs: tuple[int, ...]) -> Array:
    """Information (k, 18) that log coefficients share with the time of thrust, s, in each of the k axes `dofs`."""
    out = np.zeros((len(dofs), len(COUNTED)))
    for row, dof in enumerate(dofs):
        axis = axis_of(step_s, nu[:, dof], *_drag_and_noise(knowledge, dof))
        later = axis.impedance * axis.velocity * 1j * axis.w / (1 + 1j * axis.w * LATER_S)
        out[row, _places(dof, len(axis.answers))] = axis.information(later[None])[:, 0]
    return out


def _drag_and_noise(knowledge: Knowledge, dof: int) -> tuple[float, float, float, AxisNoise]:
    m, d, d2 = (knowledge.values.get(group[dof].name, 0.0) for group in (MASSES, DAMPINGS, QUADRATICS))
    return m, d, d2, knowledge.noise[dof]


def _places(dof: int, count: int) -> list[int]:
    return [COUNTED.index(group[dof].name) for group in (MASSES, DAMPINGS, QUADRATICS)[:count]]


@dataclass(frozen=True)
class MovingAxis:
    """An axis in motion: by frequency `w` (m,), rad/s, the spectrum of its `velocity`, its `impedance`, and the
    `weight` of a force's square.

    `answers` (k, m): the forces that a change of log M, of log D and, where there is quadratic drag, of log D2 make.
    """

    w: Array
    velocity: Complex
    impedance: Complex
    weight: Array
    answers: Complex

    def information(self, others: Complex) -> Array:
        """Information (k, l) that the coefficients share with what makes the forces `others` (l, m)."""
        return np.asarray((np.conj(self.answers) * self.weight @ others.T).real)


def axis_of(
    step_s: float, velocity: Array, mass: float, damping: float, quadratic: float, noise: AxisNoise
) -> MovingAxis:
    """The axis that moves with `velocity` (n,)."""
    frequency = np.asarray(np.fft.rfftfreq(len(velocity), step_s), dtype=np.float64)
    used = (frequency > 0) & (frequency <= TELLING_HZ)
    w = 2 * np.pi * frequency[used]
    v, v2 = (np.fft.rfft(each)[used] * step_s for each in (velocity, np.abs(velocity) * velocity))
    # The slope of all drag at the usual speed, of both signs alike.
    slope = damping + 2 * quadratic * float(np.sqrt(np.mean(velocity**2)))
    impedance = mass * 1j * w + slope
    # Noise density of a velocity that is measured directly and also as the slope of its measured integral.
    read = 1.0 / (1.0 / noise.velocity + 1.0 / (w * w * noise.position))
    pushed = 2 * noise.disturbance**2 * noise.time_constant_s / (1 + (w * noise.time_constant_s) ** 2)
    # Factor 2 for the negative frequencies, 1 / duration for the width of a spectral line.
    weight: Array = 2.0 / (np.abs(impedance) ** 2 * read + pushed) / (len(velocity) * step_s)
    answers = [mass * 1j * w * v, damping * v, *([quadratic * v2] if quadratic > 0 else ())]
    return MovingAxis(w, v, impedance, weight, np.array(answers))


def widths(identified: Identification) -> dict[str, float]:
    """Half of the 95 % interval over the value, given the vehicle file's thrust; inf if not identifiable."""
    return {
        parameter.name: (ends.high95 - ends.low95) / 2 / parameter.value
        if parameter.identifiable
        else math.inf
        for parameter in identified.parameters
        if parameter.name in NAMES
        for ends in [parameter.at_thrust]
    }
