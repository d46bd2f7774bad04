"""Simulators that a model can be written for, by name.

Lists the parts of a model that a target can't hold, in words, with the target's reasons.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES
from bridge.vehicle.effect_coefficients import QUADRATIC
from identify.export import ardusub_json, gazebo, stonefish
from identify.export.model import Model


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
    squared = [f"{name} {value:.4g}" for name, value in zip(QUADRATIC, model.quadratic, strict=True) if value]
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
            [linear[i] for i in turning if model.linear[i]] + [s for s in squared if s[:4] in QUADRATIC[3:]],
        ),
        "oblique": "drag across the axes" if any((*model.linear[:3], *model.quadratic[:3])) else "",
        "quadratic": _listed("quadratic drag", [s for s in squared if s[:4] in QUADRATIC[:3]]),
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
    """`write` returns the file's text; `reasons` say, by part of a model, why the part does not fit."""

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
