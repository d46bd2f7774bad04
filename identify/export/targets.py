"""Simulators that a model can be written for, by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from identify.export import ardusub_json, gazebo, stonefish
from identify.export.holding import Exported, left_out
from identify.export.model import Model


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
