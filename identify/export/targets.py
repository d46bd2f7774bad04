"""The simulators that a model can be written for, the effects in a model, and the parts that a target can't hold."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Vector3
from bridge.vehicle.coefficients import (
    BY_NAME,
    DAMPINGS,
    DOFS,
    MASSES,
    OF_ANY_VEHICLE,
    QUADRATIC_NAMES,
    AcceptedEffect,
    Group,
)
from identify.effects.actuators import AXES
from identify.effects.effect import Effect
from identify.export import ardusub_json, gazebo, stonefish
from identify.export.model import Model, Propeller, six
from identify.ingest.rotation import turned_by


@dataclass(frozen=True)
class LeftOut:
    """A part of the model that does not fit the target unchanged, with the reason and, if possible, a remedy."""

    what: str
    reason: str


@dataclass(frozen=True)
class Exported:
    """The text of the file, the parts that did not fit, and further notes on its values."""

    text: str
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...] = ()


def parts(model: Model) -> dict[str, str]:
    """Parts of a model that are present and that not every simulator supports, in words with their numbers."""
    moving, turning = range(3), range(3, 6)
    linear = [f"{c.name} {value:.4g}" for c, value in zip(DAMPINGS, model.linear, strict=True)]
    squared = [
        f"{name} {value:.4g}" for name, value in zip(QUADRATIC_NAMES, model.quadratic, strict=True) if value
    ]
    descriptions = {
        "model": "the model as a file",
        "shape": "the hull's shape",
        "lag": f"thruster lag {model.lag_s:g} s" if model.lag_s else "",
        "thrusters": f"{len(model.thrusters)} thrusters" if model.thrusters else "",
        "gain": _by_thruster("thruster gain", [t.gain for t in model.thrusters], 1.0),
        "reverse_gain": _by_thruster("gain astern", [t.reverse_gain for t in model.thrusters], 1.0),
        "dead_zone": _by_thruster("dead zone in N", [t.dead_zone_n for t in model.thrusters], 0.0),
        "least": _by_thruster("least thrust in N", [t.least_n for t in model.thrusters], 0.0),
        "curve": "thrust over pulse width" if model.curve else "",
        "mass_by_axis": _masses(model),
        "unknown_mass": _listed("unknown mass", [c.name for c in MASSES[:3] if c.name in model.unknown]),
        "unknown_inertia": _listed(
            "unknown inertia", [c.name for c in MASSES[3:] if c.name in model.unknown]
        ),
        "undamped_moving": _listed("unknown damping", [DOFS[i] for i in model.undamped if i in moving]),
        "undamped_turning": _listed(
            "unknown damping of turns", [DOFS[i] for i in model.undamped if i in turning]
        ),
        "added": "added mass" if any(model.added) else "",
        "moving_damping": _listed("linear damping", [linear[i] for i in moving if model.linear[i]]),
        "turning_damping": _listed(
            "damping of turns",
            [linear[i] for i in turning if model.linear[i]]
            + [s for s in squared if s[:4] in QUADRATIC_NAMES[3:]],
        ),
        "oblique": "drag across the axes" if any((*model.linear[:3], *model.quadratic[:3])) else "",
        "quadratic": _listed("quadratic drag", [s for s in squared if s[:4] in QUADRATIC_NAMES[:3]]),
        "righting": "centres of gravity and buoyancy"
        if model.centre_of_gravity_m != model.centre_of_buoyancy_m
        else "",
        "net_buoyancy": f"net buoyancy {model.net_buoyancy_n:g} N" if model.net_buoyancy_n else "",
        "added_in_current": "added mass in a current" if any(model.added) and any(model.current_m_s) else "",
        "vertical_current": f"current of {model.current_m_s[2]:g} m/s down" if model.current_m_s[2] else "",
        "effects": _listed("accepted effects", list(model.unheld)),
        "intervals": "95 % intervals" if model.intervals else "",
    }
    if model.lag_s and (descriptions["dead_zone"] or descriptions["least"]):
        descriptions["dead_zone_before_lag"] = "dead zone before the lag"
    return {part: words for part, words in descriptions.items() if words}


def left_out(model: Model, reasons: Mapping[str, str]) -> tuple[LeftOut, ...]:
    """Parts that are present and that a target has a reason against; `{model...}` in a reason is filled in."""
    return tuple(
        LeftOut(words, reasons[part].format(model=model))
        for part, words in parts(model).items()
        if part in reasons
    )


def _by_thruster(words: str, values: list[float], neutral: float) -> str:
    return _listed(words, [f"thruster {i} {v:.4g}" for i, v in enumerate(values, start=1) if v != neutral])


def _listed(words: str, items: list[str]) -> str:
    return f"{words} ({', '.join(items)})" if items else ""


def _masses(model: Model) -> str:
    masses = [
        "unknown" if c.name in model.unknown else f"{value:.4g} kg"
        for c, value in zip(MASSES[:3], model.total, strict=False)
    ]
    if len(set(model.total[:3])) == 1 and "unknown" not in masses:
        return ""
    return _listed("mass by direction", [f"{c.name} {mass}" for c, mass in zip(MASSES, masses, strict=False)])


@dataclass(frozen=True)
class Target:
    """A simulator's format: `write` returns the file's text, `reasons` say, by part of a model, why it does not fit."""

    write: Callable[[Model], str]
    reasons: Mapping[str, str]


TARGETS = {
    "gazebo": Target(gazebo.write, gazebo.REASONS),
    "stonefish": Target(stonefish.write, stonefish.REASONS),
    "ardusub-json": Target(ardusub_json.write, ardusub_json.REASONS),
}


def export(model: Model, name: str) -> Exported:
    """Write the model in the format of the target `name`, one of TARGETS, and list the parts that did not fit."""
    target = TARGETS[name]
    return Exported(target.write(model), left_out(model, target.reasons), model.notes)


HELD: frozenset[Group] = frozenset({"quadratic_drag", "thruster_gain", "reverse_loss", "dead_zone"})
"""Groups of feed-forward coefficients that stand for an effect that every model has a place for."""


def is_held(coefficient: str) -> bool:
    """Whether a model has a place for a coefficient of the feed-forward, and so for its interval."""
    of_effect = OF_ANY_VEHICLE.get(coefficient)
    return coefficient in BY_NAME if of_effect is None else of_effect.group in HELD


def with_effects(model: Model, effects: Sequence[AcceptedEffect], library: Sequence[Effect]) -> Model:
    """The model with the effects applied; labels of effects that the model has no place for go into `unheld`.

    Effects that are already in the masses and dampings are left out. These are identified with the vehicle file's
    thrust, so they are as much too large as the real thrust is smaller than the file's.
    """
    by_label = {(effect.label, effect.number): effect for effect in library}
    for accepted in effects:
        effect = by_label.get((accepted.label, accepted.number))
        if effect is not None and effect.in_coefficients:
            continue
        if effect is None or not effect.model_part:
            model = replace(model, unheld=(*model.unheld, accepted.label))
        else:
            model = _with_effect(model, effect, [accepted.parameters[p.name] for p in effect.parameters])
    return model


def _with_effect(model: Model, effect: Effect, values: Sequence[float]) -> Model:
    part, size = effect.model_part, values[0]
    if part == "quadratic":
        return replace(model, quadratic=six([q + m for q, m in zip(model.quadratic, values, strict=True)]))
    if part == "current_m_s":
        (north, east, down), (more_north, more_east) = model.current_m_s, values
        return replace(model, current_m_s=(north + more_north, east + more_east, down))
    if part == "net_buoyancy_n":
        return replace(model, net_buoyancy_n=model.net_buoyancy_n + size)
    if part == "lag_s":
        return replace(model, lag_s=size)
    if part == "other_lag_s":
        form = f"the thrusters' lag was accepted {effect.variant}"
        note = f"{form}: one of first order, as late, is written, {size:.3g} s"
        return replace(model, lag_s=size, notes=(*model.notes, note))
    changed = tuple(
        _with_fault(thruster, effect, size) if effect.number in (0, i) else thruster
        for i, thruster in enumerate(model.thrusters, start=1)
    )
    return replace(model, thrusters=changed)


def _with_fault(thruster: Propeller, effect: Effect, size: float) -> Propeller:
    if effect.model_part == "direction":
        return replace(thruster, direction=_turned(thruster.direction, AXES[effect.about], size))
    if effect.model_part == "limit_n":
        return replace(thruster, low_n=max(thruster.low_n, -size), high_n=min(thruster.high_n, size))
    if effect.model_part == "gain":
        return replace(thruster, gain=thruster.gain * size)
    if effect.model_part == "reverse_gain":
        return replace(thruster, reverse_gain=thruster.reverse_gain * size)
    if effect.model_part == "least_n":
        return replace(thruster, least_n=size)
    return replace(thruster, dead_zone_n=size)


def _turned(way: Vector3, axis: Vector3, angle_rad: float) -> Vector3:
    x, y, z = turned_by(angle_rad * np.array([axis]), np.array([way]))[0].tolist()
    return x, y, z
