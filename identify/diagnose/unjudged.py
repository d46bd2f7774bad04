"""Causes and degrees of freedom that a recording can't tell of, with the reason and the readings to record."""

from collections.abc import Collection, Sequence

import numpy as np

from bridge.vehicle.coefficients import DOFS, SURGE, SWAY
from bridge.vehicle.config import Configuration, Water
from identify.checks.sensors.descent import depth_contradicts
from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.gap.missing import PUSHED
from identify.dive import Dive
from identify.effects.effect import OWN_DESCENT, OWN_VELOCITY, PULSES, QUICK_COMMANDS, Effect
from identify.ingest.commands import sampled_seldom
from identify.thrust.wrench import PULSES_IN, tells_thrusters
from identify.words import listed

OF_FILTER = frozenset({OWN_VELOCITY, OWN_DESCENT})
"""Lacks of every dive whose velocity is an autopilot's: the verdict need not mention them."""


def lacking(dive: Dive, check: Dive | None, configuration: Configuration, water: Water) -> frozenset[str]:
    """The inputs that effects need (`Effect.needs`) and that a dive or its check dive lacks; a late thrust need not
    show in the check dive."""
    dives = [dive] if check is None else [dive, check]
    filtered = [each.velocity_is_filtered and _has_velocity(each) for each in dives]
    has = {
        PULSES: all(tells_thrusters(each, configuration) for each in dives),
        QUICK_COMMANDS: not seldom(dive, configuration),
        OWN_VELOCITY: not any(filtered),
        OWN_DESCENT: not filtered[0] or depth_contradicts(dive, water),
    }
    return frozenset(name for name, is_there in has.items() if not is_there)


def unjudged_causes(lacks: Collection[str]) -> tuple[str, ...]:
    """Sentences on the causes that can't be judged without these inputs, and on the data to record."""
    words = {
        PULSES: "No pulses tell what each thruster did: causes in a single thruster, or in the thrusters' curve, were "
        f"not judged; record them ({PULSES_IN}).",
        QUICK_COMMANDS: "Thruster commands come too seldom: a delay or a lag of the thrusters was not judged; record "
        "them at 10 Hz or more.",
        OWN_VELOCITY: "The velocity is that of an autopilot's filter. How late it is was fitted with the nominal "
        "model, and a late DVL was not judged; record the DVL's own readings for that.",
        OWN_DESCENT: "An autopilot's filter takes its speed up and down from the depth sensor as well: a wrong scale "
        "of that sensor was not judged.",
    }
    return tuple(sentence for name, sentence in words.items() if name in lacks)


def unjudged_by_check(lacks: Collection[str]) -> tuple[str, ...]:
    """Sentences on the causes that can't be judged because the check dive lacks these inputs, and on the way out."""
    words = {
        PULSES: "No pulses of the check dive tell what each thruster did: causes in a single thruster, or in the "
        "thrusters' curve, were not judged; check on a dive that has them, or leave the check out.",
        OWN_VELOCITY: "The velocity of the check dive is that of an autopilot's filter: a late DVL was not judged; "
        "check on a dive of the DVL's own readings, or leave the check out.",
    }
    return tuple(sentence for name, sentence in words.items() if name in lacks)


def able(
    effects: Sequence[Effect], lacks: Collection[str], configuration: Configuration
) -> tuple[Effect, ...]:
    """The effects whose needs (`Effect.needs`) the recording holds, without those that the hull's model already has."""
    in_model = {"quadratic"} if configuration.damping != "linear" else set()
    return tuple(
        effect for effect in effects if not {*lacks} & {*effect.needs} and effect.model_part not in in_model
    )


def seldom(dive: Dive, configuration: Configuration) -> bool:
    """Whether the thrusters' commands come too seldom to tell when the thrust acts."""
    commands = dive.thruster_commands if tells_thrusters(dive, configuration) else dive.tau_cmd
    if dive.reckoned is not None:
        return not dive.reckoned.tells_timing
    return commands is not None and sampled_seldom(commands)


def unjudged_notes(nominal: Nominal) -> tuple[str, ...]:
    """Sentences on degrees of freedom that were not judged, why, and what to record: the verdict does not cover them.

    Roll and pitch right themselves; without thrust there, nobody misses them.
    """
    built = nominal.built
    missing = (
        f"{DOFS[dof].capitalize()} was not judged: {why}."
        for dof, why in sorted(built.missing.items())
        if dof in PUSHED or dof not in built.unpushed
    )
    unseen = (
        f"In {listed([DOFS[dof] for dof in nominal.velocity_unread])} no unknown force was looked for: without a "
        "velocity the climb that a controller knows, and a drift that turns the hull, look like one; record the DVL.",
    )
    used = listed([DOFS[dof] for dof in nominal.feedback_unrecorded if dof in (SURGE, SWAY)])
    foreign = (
        f"In {listed([DOFS[dof] for dof in nominal.feedback_suspected])} no unknown force was looked for: the "
        f"controller used a reading that was not recorded in {used}, and may have done so there; record the very "
        "velocity that it uses.",
    )
    return (
        *missing,
        *(unseen if nominal.velocity_unread else ()),
        *(foreign if nominal.feedback_suspected else ()),
    )


def _has_velocity(dive: Dive) -> bool:
    return dive.velocity is not None and bool(np.isfinite(dive.velocity.value).any())
