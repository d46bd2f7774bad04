"""The wet doctor: finds swapped, reversed or dead thrusters, and the true mountings of DVL, IMU and gyro.

Every hypothesis is tried: 48 ways to mount the DVL (24 turns in steps of 90 degrees and their mirror images), 48 for
the IMU, two for the fibre-optic gyro, and for each the assignment of channels to thrusters, forwards or reversed, that
explains the pulses best (a linear assignment problem, so none is missed). A hypothesis pays for the response it leaves
unexplained and for each fault that it claims: the simplest explanation that fits wins. Its distance to the next best
explanation gives the confidence.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from bridge.arrays import Array
from bridge.attitude import angles_of
from bridge.errors import LogError
from bridge.sensors.mounting import mounting_matrix
from bridge.vehicle.config import GRAVITY_M_S2, Configuration, Mounting, Vehicle
from bridge.vehicle.thrusters import Curve
from gcs_plugin.doctor import response
from gcs_plugin.doctor.checks import Finding, fail, ok, warn
from gcs_plugin.doctor.wet_record import Pulse, WetRecord, find_pulses


def _all_turns() -> tuple[Array, ...]:
    turns = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            turns.append(matrix)
    # The identity first, then the proper turns, then the mirrors, each sorted by how little they turn.
    return tuple(sorted(turns, key=lambda m: (bool(np.linalg.det(m) < 0), -np.trace(m))))


TURNS: Final = _all_turns()
MOUNTINGS: Final = {"dvl": TURNS, "imu": TURNS, "fog": (np.eye(1), -np.eye(1))}
TURNED_IN: Final = {"dvl": "dvl", "imu": "rate", "fog": "fog"}
"""The feature that shows how each sensor is turned."""
IDENTITY: Final = 0


def is_mirror(turn: Array) -> bool:
    return bool(np.linalg.det(turn) < 0)


def describe(turn: Array) -> str:
    """Describe the measured axes by the true ones: `x shows -y, y shows x`."""
    parts = []
    for row, name in enumerate("xyz"):
        column = int(np.abs(turn[row]).argmax())
        if column != row or turn[row, column] < 0:
            parts.append(f"{name} shows {'-' if turn[row, column] < 0 else ''}{'xyz'[column]}")
    return ", ".join(parts) or "all axes are right"


def corrected(mounting: Mounting, turn: Array) -> Mounting:
    """Return the mounting that undoes `turn`, given measured = turn @ true under the present `mounting`.

    The signs stay as they are for a turn. For a mirror one more sign changes: the choice that leaves least rotation.
    """
    matrix = turn.T @ np.array(mounting_matrix(mounting))
    now = np.array(mounting.signs)
    flips = [np.ones(3)] if not is_mirror(turn) else [1.0 - 2.0 * np.eye(3)[axis] for axis in range(3)]
    best = max(flips, key=lambda flip: np.trace(matrix @ np.diag(now * flip)))
    signs = now * best
    # Adding 0 makes -0 a 0.
    roll, pitch, yaw = (round(math.degrees(a), 3) + 0.0 for a in angles_of(matrix @ np.diag(signs)))
    x, y, z = map(float, signs)
    return replace(mounting, rotation_deg=(roll, pitch, yaw), signs=(x, y, z))


WEIGHTS: Final = {"dvl": 1.0, "rate": 1.0, "force": 0.5, "fog": 0.5}
THRUSTER_FAULT: Final = 2.0
MOUNTING_FAULT: Final = 4.0
MIRROR_FAULT: Final = 1.0
GRAVITY_WEIGHT: Final = 20.0
AXIS_GAIN_LIMIT: Final = 3.0
MODEL_ERROR: Final = 0.35
CROSS_TALK: Final = 0.05
WRONG: Final = 12.0
CONFIDENT: Final = 0.8
FAR: Final = 12.0
BACKWARDS, DEAD = 1, 2
LABELS: Final = {"dvl": "DVL", "imu": "IMU", "fog": "fibre-optic gyro"}


@dataclass(frozen=True)
class Diagnosis:
    """The best explanation of the pulses.

    `thruster_of` (channels,) is the thruster that each channel drives, `sign` (channels,) +1 or -1; `responds`
    (channels,) bool; `turn` by sensor, measured = turn @ true; `confidence` by `thruster N` and sensor.
    """

    pulses: tuple[Pulse, ...]
    thruster_of: NDArray[np.int_]
    sign: Array
    responds: NDArray[np.bool_]
    turn: dict[str, Array]
    confidence: dict[str, float]


def diagnose(vehicle: Vehicle, configuration: Configuration, curve: Curve, record: WetRecord) -> Diagnosis:
    """Find the best explanation of a wet check. Raises LogError if a thruster had no pulse, or no sensor has data."""
    pulses = _one_pulse_each(find_pulses(record.pwm), len(configuration.thrusters))
    felt = response.measured(record, pulses)
    if not felt:
        raise LogError("no sensor said anything during the pulses; check that DVL, IMU or gyro are recorded")
    want = response.expected(vehicle, configuration, curve, pulses)
    scale = {name: _scale(felt[name], want[name]) for name in felt}
    noise, rest_force = response.feature_noise(record, pulses), response.rest_force(record, pulses)
    evidence = _Evidence(felt, want, noise, scale, rest_force)
    return _search(pulses, evidence)


def _one_pulse_each(pulses: Sequence[Pulse], thrusters: int) -> tuple[Pulse, ...]:
    first = {pulse.thruster: pulse for pulse in reversed(pulses)}
    missing = [str(index + 1) for index in range(thrusters) if index not in first]
    if missing:
        raise LogError(
            f"no pulse of thruster {', '.join(missing)} alone in this recording; run doctor --wet again"
        )
    return tuple(first[index] for index in range(thrusters))


def _scale(felt: Array, want: Array) -> float:
    """Ratio of the measured to the expected response, which no turn, swap or reversal changes."""
    in_place = want[np.arange(len(want)), np.arange(len(want))]
    good = np.isfinite(felt).all(axis=1)
    size = np.sqrt((in_place[good] ** 2).sum())
    return float(np.sqrt((felt[good] ** 2).sum()) / size) if size > 0 and good.any() else 1.0


@dataclass(frozen=True)
class _Evidence:
    """Responses to the pulses by sensor: measured `felt` (channels, k) and expected `want` (channels, thrusters, k).

    `noise` (k,); `scale`: overall ratio of measured to expected; `at_rest` (3,): specific force before the first pulse.
    """

    felt: dict[str, Array]
    want: dict[str, Array]
    noise: dict[str, Array]
    scale: dict[str, float]
    at_rest: Array | None

    @property
    def channels(self) -> int:
        return len(next(iter(self.want.values())))


def _cost(evidence: _Evidence, name: str, turn: Array) -> Array:
    """Unexplained response (channels, thrusters, 3) if a sensor is mounted with `turn`: forwards, reversed, dead.

    Each axis counts in units of the model's error and the noise. Mass and inertia are known only roughly, so each
    axis may have its own gain, within limits.
    """
    count = evidence.channels
    if name not in evidence.felt:
        return np.zeros((count, count, 3))
    want = evidence.want[name]
    true = evidence.felt[name] @ turn / evidence.scale[name]
    sigma = evidence.noise[name] @ np.abs(turn) / evidence.scale[name]
    good = np.isfinite(true).all(axis=1)
    in_place = want[np.arange(count), np.arange(count)]
    rms_felt = np.sqrt((true[good] ** 2).mean(axis=0)) if good.any() else np.ones(true.shape[1])
    rms_want = np.sqrt((in_place**2).mean(axis=0))
    whole = np.sqrt((rms_want**2).sum()) + 1e-12
    gain = np.clip(rms_felt / np.maximum(rms_want, 0.05 * whole), 1 / AXIS_GAIN_LIMIT, AXIS_GAIN_LIMIT)
    unit = np.sqrt((MODEL_ERROR * rms_want) ** 2 + (CROSS_TALK * whole) ** 2 + (sigma / gain) ** 2)
    stories = np.stack([want, -want, np.zeros_like(want)], axis=-1)
    off = ((true / gain)[:, None, :, None] - stories) / unit[None, None, :, None]
    # Beyond a few units the explanation is wrong; a larger distance adds no information.
    left = (off**2 / (1.0 + off**2 / WRONG)).sum(axis=2)
    left[~good] = 0.0
    return np.asarray(WEIGHTS[name] * left)


def _imu_cost(evidence: _Evidence, turn: Array) -> Array:
    cost = _cost(evidence, "rate", turn) + _cost(evidence, "force", turn)
    if evidence.at_rest is not None:
        off = evidence.at_rest @ turn / GRAVITY_M_S2 - np.array([0.0, 0.0, -1.0])
        cost = cost + GRAVITY_WEIGHT * float(off @ off) / len(cost)
    return np.asarray(cost)


def _penalty(count: int) -> Array:
    """Cost (channels, thrusters, 3) of each claim; zero if it agrees with the vehicle file."""
    penalty = np.full((count, count, 3), THRUSTER_FAULT)
    same = np.eye(count, dtype=bool)
    penalty[same, 0] = 0.0
    penalty[~same, 1] = 2 * THRUSTER_FAULT
    penalty[same, 2] = 1.5 * THRUSTER_FAULT
    penalty[~same, 2] = 4 * THRUSTER_FAULT
    return penalty


def _claim(index: int) -> float:
    if index == IDENTITY:
        return 0.0
    return MOUNTING_FAULT + (MIRROR_FAULT if is_mirror(TURNS[index]) else 0.0)


def _claim_of(sensor: str, index: int) -> float:
    if sensor == "fog":
        return 0.0 if index == IDENTITY else MOUNTING_FAULT
    return _claim(index)


def _search(pulses: tuple[Pulse, ...], evidence: _Evidence) -> Diagnosis:
    present = {sensor: feature in evidence.felt for sensor, feature in TURNED_IN.items()}
    # A sensor that felt nothing has one mounting alone, which costs nothing.
    turns = {
        sensor: MOUNTINGS[sensor] if there else MOUNTINGS[sensor][:1] for sensor, there in present.items()
    }
    dvl = [_cost(evidence, "dvl", turn) for turn in turns["dvl"]]
    imu = [_imu_cost(evidence, turn) for turn in turns["imu"]]
    fog = [_cost(evidence, "fog", turn) for turn in turns["fog"]]
    penalty = _penalty(len(pulses))
    score = _scores(dvl, imu, fog, penalty)
    d, i, f = (int(index) for index in np.unravel_index(int(score.argmin()), score.shape))
    combined = dvl[d] + imu[i] + fog[f] + penalty
    cheapest = combined.min(axis=2)
    _, thruster_of = linear_sum_assignment(cheapest)
    channels = np.arange(len(pulses))
    story = combined[channels, thruster_of].argmin(axis=1)
    chosen = dict(zip(turns, (d, i, f), strict=True))
    confidence = {
        sensor: _confidence(_margin(score, axis, index, sensor)) if present[sensor] else 1.0
        for axis, (sensor, index) in enumerate(chosen.items())
    }
    bare = float(cheapest[channels, thruster_of].sum())
    for channel in channels:
        confidence[f"thruster {channel + 1}"] = _confidence(
            _second_best(combined, int(channel), int(thruster_of[channel]), int(story[channel])) - bare
        )
    turn = {sensor: turns[sensor][index] for sensor, index in chosen.items() if present[sensor]}
    sign = np.where(story == BACKWARDS, -1.0, 1.0)
    return Diagnosis(pulses, thruster_of, sign, story != DEAD, turn, confidence)


def _scores(dvl: list[Array], imu: list[Array], fog: list[Array], penalty: Array) -> Array:
    """Cost (dvl, imu, fog) of the best assignment under each hypothesis.

    If a lower bound shows that a hypothesis can't come within `FAR` of the best, its score is that bound.
    """
    score = np.empty((len(dvl), len(imu), len(fog)))
    left = np.array(imu)
    claims = np.array([_claim(index) for index in range(len(imu))])
    for d, dvl_cost in enumerate(dvl):
        for f, fog_cost in enumerate(fog):
            # Every channel must drive some thruster, so the sum of the cheapest choices is a lower bound of the cost.
            cheapest = (left + (dvl_cost + fog_cost + penalty)).min(axis=(2, 3))
            score[d, :, f] = cheapest.sum(axis=1) + claims + _claim_of("dvl", d) + _claim_of("fog", f)
    best = np.inf
    for flat in np.argsort(score, axis=None):
        d, i, f = (int(index) for index in np.unravel_index(flat, score.shape))
        bound = score[d, i, f]
        if bound > best + FAR:
            break
        total = (dvl[d] + imu[i] + fog[f] + penalty).min(axis=2)
        rows, columns = linear_sum_assignment(total)
        score[d, i, f] = total[rows, columns].sum() + bound - total.min(axis=1).sum()
        best = min(best, float(score[d, i, f]))
    return score


def _margin(score: Array, axis: int, index: int, sensor: str) -> float:
    """By how much the next best mounting of a sensor is worse, also without the costs of the claims: pulses that tell
    nothing of a mounting would leave those alone, and they alone prove none right."""
    along = np.moveaxis(score, axis, 0).reshape(score.shape[axis], -1).min(axis=1)
    bare = along - np.array([_claim_of(sensor, each) for each in range(len(along))])
    return float(min(np.delete(each, index).min() - each[index] for each in (along, bare)))


def _second_best(combined: Array, channel: int, thruster: int, story: int) -> float:
    """Cost of the best explanation in which this channel does something else."""
    without = combined.copy()
    without[channel, thruster, story] = 1e6
    cheapest = without.min(axis=2)
    rows, columns = linear_sum_assignment(cheapest)
    return float(cheapest[rows, columns].sum())


def _confidence(margin: float) -> float:
    """Confidence from the distance to the next best explanation, as a log-likelihood ratio: 0.63 at a distance of 2."""
    return float(1.0 - np.exp(-0.5 * max(margin, 0.0)))


def findings(diagnosis: Diagnosis, vehicle: Vehicle) -> list[Finding]:
    """Describe the diagnosis in sentences, with advice."""
    sentences = []
    for channel in range(len(diagnosis.pulses)):
        sentences.append(_thruster_finding(diagnosis, channel))
    for sensor, turn in diagnosis.turn.items():
        sentences.append(_mounting_finding(diagnosis, vehicle, sensor, turn))
    return sentences


def _thruster_finding(diagnosis: Diagnosis, channel: int) -> Finding:
    name = f"thruster {channel + 1}"
    conf = diagnosis.confidence[name]
    if not diagnosis.responds[channel]:
        return fail(name, f"{name} moved nothing; check its power, its lead and its propeller", conf)
    driven, backwards = int(diagnosis.thruster_of[channel]), diagnosis.sign[channel] < 0
    if driven == channel and not backwards:
        if conf < CONFIDENT:
            return warn(name, f"{name} seems right, but its pulse was too weak to be sure", conf)
        return ok(name, f"{name} is where the vehicle file has it, and pushes forwards", conf)
    trouble = []
    if driven != channel:
        swapped = int(diagnosis.thruster_of[driven]) == channel
        how = "are swapped" if swapped else "do not agree: the first drives the second"
        trouble.append(f"{name} and thruster {driven + 1} {how}; swap their signal leads")
    if backwards:
        trouble.append(
            f"{name} pushes backwards; swap two of its motor leads, or turn its direction in the file"
        )
    sentence = "; ".join(trouble)
    return fail(name, sentence, conf) if conf >= CONFIDENT else warn(name, f"it seems that {sentence}", conf)


def _mounting_finding(diagnosis: Diagnosis, vehicle: Vehicle, sensor: str, turn: Array) -> Finding:
    conf, label = diagnosis.confidence[sensor], LABELS[sensor]
    if np.array_equal(turn, np.eye(len(turn))):
        if conf < CONFIDENT:
            return warn(
                sensor, f"{label}: its mounting seems right, but the pulses were too weak to be sure", conf
            )
        return ok(sensor, f"{label}: its mounting is right", conf)
    device = getattr(vehicle.sensors, sensor)
    mounting = device.mounting if device is not None else Mounting()
    if sensor == "fog":
        sentence = f"{label}: its sign is wrong; turn its mounting over"
    else:
        right = corrected(mounting, turn)
        angles = ", ".join(f"{angle:g}" for angle in right.rotation_deg)
        signs = ", ".join(f"{value:g}" for value in right.signs)
        sentence = f"{label}: {describe(turn)}; set its mounting to rotation_deg [{angles}], signs [{signs}]"
    return (
        fail(sensor, sentence, conf) if conf >= CONFIDENT else warn(sensor, f"it seems that {sentence}", conf)
    )
