"""What is known of that which no candidate explains: where it acts, what it goes with, how it comes and goes."""

from bridge.vehicle.coefficients import DOFS
from identify.diagnose.diagnosis import Character, Fixed
from identify.diagnose.generic import Left, Parity, Timing, Variable

WORLD: tuple[Variable, ...] = ("heading", "position")
BODY: tuple[Variable, ...] = ("speed", "yaw_rate", "acceleration", "thrust", "thrust_sign")
TIMINGS: dict[Variable, Timing] = {"time": "drifting", "voltage": "drifting", "acceleration": "transient"}


def character_of(left: Left) -> Character:
    """By the shapes that foretell it, each weighed by the nats that it saves."""
    weight = dict.fromkeys(DOFS, 0.0)
    frames: dict[Fixed, float] = {"body": 0.0, "world": 0.0, "neither": 0.0}
    parities: dict[Parity, float] = {"odd": 0.0, "even": 0.0, "neither": 0.0}
    timings: dict[Timing, float] = {"steady": 0.0}
    for shape, gain in zip(left.shapes, left.gains, strict=True):
        weight[DOFS[shape.dof]] += gain
        frames["world" if shape.variable in WORLD else "body" if shape.variable in BODY else "neither"] += (
            gain
        )
        parities[shape.parity or "neither"] += gain
        timing = shape.timing or TIMINGS.get(shape.variable, "steady")
        timings[timing] = timings.get(timing, 0.0) + gain
    strongest = max(weight.values(), default=0.0)
    return Character(
        tuple(dof for dof in DOFS if weight[dof] > 0.3 * strongest),
        max(frames, key=lambda name: frames[name]),
        max(parities, key=lambda name: parities[name]),
        max(timings, key=lambda name: timings[name]),
        tuple(dict.fromkeys(shape.variable for shape in left.shapes)),
    )
