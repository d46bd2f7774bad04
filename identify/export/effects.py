"""Puts accepted effects into a model, as far as the model's form has a place for them, and names the others."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from bridge.vehicle.accepted_effect import AcceptedEffect
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import Vector3
from bridge.vehicle.effect_coefficients import OF_ANY_VEHICLE, Group
from identify.export.model import Model, Propeller, six

IN_COEFFICIENTS = ("added_payload", "entrained_water", "fouling (since the last time)", "thrust_gain")
"""Names and labels of effects that are already in the masses and dampings. These are identified with the vehicle
file's thrust, so they are as much too large as the real thrust is smaller than the file's.
"""

ALL_ABOVE = "all above it"


HELD: frozenset[Group] = frozenset({"quadratic_drag", "thruster_gain", "reverse_loss", "dead_zone"})
"""Groups of feed-forward coefficients that stand for an effect that every model has a place for."""


def is_held(coefficient: str) -> bool:
    """Whether a model has a place for a coefficient of the feed-forward, and so for its interval."""
    of_effect = OF_ANY_VEHICLE.get(coefficient)
    return coefficient in BY_NAME if of_effect is None else of_effect.group in HELD


def with_effects(model: Model, effects: Sequence[AcceptedEffect]) -> Model:
    """The model with the effects applied; labels of effects that the model has no place for go into `unheld`."""
    for effect in effects:
        if effect.name in IN_COEFFICIENTS or effect.label in IN_COEFFICIENTS:
            continue
        change = CHANGES.get(effect.name)
        changed = None if change is None else change(model, effect)
        model = replace(model, unheld=(*model.unheld, effect.label)) if changed is None else changed
    return model


def _drag(model: Model, effect: AcceptedEffect) -> Model:
    more = effect.parameters.values()
    return replace(model, quadratic=six([q + m for q, m in zip(model.quadratic, more, strict=True)]))


def _thrusters(model: Model, number: int, change: Callable[[Propeller], Propeller]) -> Model:
    """Change thruster `number`, or all thrusters for 0."""
    changed = tuple(
        change(thruster) if number in (0, i) else thruster
        for i, thruster in enumerate(model.thrusters, start=1)
    )
    return replace(model, thrusters=changed)


def _gain(model: Model, effect: AcceptedEffect) -> Model:
    gain = effect.parameters["gain"]
    return _thrusters(model, effect.number, lambda one: replace(one, gain=one.gain * gain))


def _astern(model: Model, effect: AcceptedEffect) -> Model:
    gain = effect.parameters["gain"]
    return _thrusters(model, 0, lambda one: replace(one, reverse_gain=one.reverse_gain * gain))


def _dead_zone(model: Model, effect: AcceptedEffect) -> Model:
    width_n = effect.parameters["half_width"]
    if ALL_ABOVE in effect.label:
        return _thrusters(model, 0, lambda one: replace(one, least_n=width_n))
    return _thrusters(model, 0, lambda one: replace(one, dead_zone_n=width_n))


def _limit(model: Model, effect: AcceptedEffect) -> Model:
    most_n = effect.parameters["limit"]
    return _thrusters(
        model, 0, lambda one: replace(one, low_n=max(one.low_n, -most_n), high_n=min(one.high_n, most_n))
    )


def _turned(model: Model, effect: AcceptedEffect) -> Model | None:
    """Turn a thruster by Rodrigues' formula about the body axis that ends the label; None if the effect has no angle,
    because the thruster sits elsewhere.
    """
    angle = effect.parameters.get("angle")
    if angle is None:
        return None
    axis = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}[effect.label.rstrip(")")[-1]]
    return _thrusters(
        model, effect.number, lambda one: replace(one, direction=_rotated(one.direction, axis, angle))
    )


def _rotated(way: Vector3, axis: Vector3, angle_rad: float) -> Vector3:
    (x, y, z), (a, b, c) = way, axis
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    along = (1.0 - cos) * (a * x + b * y + c * z)
    return (
        x * cos + sin * (b * z - c * y) + along * a,
        y * cos + sin * (c * x - a * z) + along * b,
        z * cos + sin * (a * y - b * x) + along * c,
    )


def _current(model: Model, effect: AcceptedEffect) -> Model:
    north, east, down = model.current_m_s
    more = effect.parameters
    return replace(model, current_m_s=(north + more["north"], east + more["east"], down))


CHANGES: dict[str, Callable[[Model, AcceptedEffect], Model | None]] = {
    "quadratic_drag": _drag,
    "weak_thruster": _gain,
    "reverse_thrust_loss": _astern,
    "dead_zone": _dead_zone,
    "saturation": _limit,
    "thruster_misalignment": _turned,
    "steady_current": _current,
    "thruster_lag": lambda model, effect: replace(model, lag_s=effect.parameters["time_constant"]),
    "net_buoyancy": lambda model, effect: replace(
        model, net_buoyancy_n=model.net_buoyancy_n + effect.parameters["force"]
    ),
}
