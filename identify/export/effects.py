"""Puts accepted effects into a model, as far as its form has a place for them, and names the others."""

import math
from collections.abc import Sequence
from dataclasses import replace

from bridge.vehicle.accepted_effect import AcceptedEffect
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import Vector3
from bridge.vehicle.effect_coefficients import OF_ANY_VEHICLE, Group
from identify.effects.actuators import AXES
from identify.effects.effect import Effect
from identify.export.model import Model, Propeller, six

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
    changed = tuple(
        _with_fault(thruster, effect, size) if effect.number in (0, i) else thruster
        for i, thruster in enumerate(model.thrusters, start=1)
    )
    return replace(model, thrusters=changed)


def _with_fault(thruster: Propeller, effect: Effect, size: float) -> Propeller:
    if effect.model_part == "direction":
        return replace(thruster, direction=_rotated(thruster.direction, AXES[effect.about], size))
    if effect.model_part == "limit_n":
        return replace(thruster, low_n=max(thruster.low_n, -size), high_n=min(thruster.high_n, size))
    if effect.model_part == "gain":
        return replace(thruster, gain=thruster.gain * size)
    if effect.model_part == "reverse_gain":
        return replace(thruster, reverse_gain=thruster.reverse_gain * size)
    if effect.model_part == "least_n":
        return replace(thruster, least_n=size)
    return replace(thruster, dead_zone_n=size)


def _rotated(way: Vector3, axis: Vector3, angle_rad: float) -> Vector3:
    """Rodrigues' formula."""
    (x, y, z), (a, b, c) = way, axis
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    along = (1.0 - cos) * (a * x + b * y + c * z)
    return (
        x * cos + sin * (b * z - c * y) + along * a,
        y * cos + sin * (c * x - a * z) + along * b,
        z * cos + sin * (a * y - b * x) + along * c,
    )
