"""docs/reference/parameters.md: the parameters that a vehicle holds, with units and bounds."""

from bridge.vehicle.coefficients import ADDED_MASS_NAMES, COEFFICIENTS, DOFS, Coefficient, effect_coefficients
from bridge.vehicle.config import MOST_VEH_CFG, load_vehicle
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import ACTIVE, COMMIT, MODE, VERSION, bounds
from docs.make.markdown import MADE, code, number, table

EXAMPLE = "ruvifist:hovering"
HEAD = ("parameter", "symbol", "unit", "what it is", "least", "most")


def page() -> str:
    file = load_vehicle(EXAMPLE)
    assert file.configuration is not None
    shape = file.vehicle.configurations[file.configuration]
    nominal = (_row(each, each.symbol, *bounds(each, shape)) for each in COEFFICIENTS)
    effects = (_row(each, each.name, each.low, each.high) for each in effect_coefficients(shape))
    modes = ", ".join(f"{mode.value} {mode.word}" for mode in Mode)
    switches = (
        (code(MODE), f"what the feed-forward does: {modes}"),
        (code(COMMIT), "write the CRC of the staged set: the whole set comes into force at once; 0: none is"),
        (code(ACTIVE), "the CRC of the set in force, 0 for none; read only"),
        (code(VERSION), "the version of the telemetry contract; read only"),
    )
    added = (
        (code(name), f"total less rigid body in {dof}")
        for name, dof in zip(ADDED_MASS_NAMES, DOFS, strict=True)
    )
    return f"""# Parameters of the vehicle

{MADE} All are MAVLink parameters of type REAL32. `n` in `FFn_` is the configuration (VEH_CFG, 0 to {MOST_VEH_CFG}). The
bounds are those of `{EXAMPLE}`: they follow from a vehicle's dry mass, inertia and thrust. A write outside of them is
refused.

## The model

0 is "not set": the feed-forward of an axis that lacks its mass (inertia), or its damping, linear or quadratic, is zero,
and says so.

{table(HEAD, nominal)}
## Accepted effects

0 is absent. They act where the feed-forward is applied.

{table(HEAD, effects)}
## The feed-forward itself

{table(("parameter", "what it is"), switches)}
## What follows

`identify` tells these beside the totals; no vehicle takes them as parameters.

{table(("name", "what it is"), added)}"""


def _row(coefficient: Coefficient, symbol: str, low: float, high: float) -> tuple[str, ...]:
    parameter = code(f"FFn_{coefficient.name.upper()}")
    return parameter, symbol, coefficient.unit, coefficient.sentence, number(low), number(high)
