"""Check that the vehicle on the link is alone there and matches the vehicle file, as the wet check requires."""

import math
from collections.abc import Sequence
from typing import Final

from bridge.vehicle.config import Vehicle
from gcs_plugin.doctor.findings import Finding, Level, fail, ok
from gcs_plugin.doctor.observe import Observed

FORBIDS_WET: Final = ("vehicle file", "link", "vehicles", "configuration", "thrusters")


def check_twins(observed: Observed) -> Finding | None:
    """Whether two vehicles share an address; None if none do."""
    return fail("vehicles", observed.twins) if observed.twins else None


def told_veh_cfg(observed: Observed) -> int | None:
    """The last VEH_CFG that the vehicle sent; None if it sent none, or a value that is no whole number."""
    arrivals = observed.arrivals.get("veh_cfg")
    value = arrivals[-1].reading.values[0] if arrivals else math.nan
    return int(value) if value.is_integer() else None


def check_configuration(observed: Observed, vehicle: Vehicle, chosen: str | None) -> Finding | None:
    """Whether the vehicle is in the configuration `chosen`, or in any of its file; None if it sent no VEH_CFG."""
    veh_cfg = told_veh_cfg(observed)
    if veh_cfg is None:
        return None
    known = {vehicle.veh_cfg(name): name for name in vehicle.configurations}
    if veh_cfg not in known:
        listed = ", ".join(f"{number} {name}" for number, name in known.items())
        return fail(
            "configuration",
            f"the vehicle says VEH_CFG {veh_cfg}, '{vehicle.name}' has {listed}; give this vehicle's own file",
        )
    if chosen is not None and chosen != known[veh_cfg]:
        return fail(
            "configuration",
            f"the vehicle says VEH_CFG {veh_cfg}, {known[veh_cfg]}, and you chose {chosen} "
            f"({vehicle.veh_cfg(chosen)}); choose {known[veh_cfg]}, or start the vehicle as {chosen}",
        )
    return ok("configuration", f"VEH_CFG {veh_cfg}, {known[veh_cfg]}")


def check_thrusters(observed: Observed, vehicle: Vehicle, chosen: str | None) -> Finding | None:
    """Whether the vehicle commands as many thrusters as its file has; None if no commands arrived."""
    arrivals = observed.arrivals.get("pwm")
    if not arrivals:
        return None
    # A pulse width of zero is no command: some autopilots fill the message's 32 fields up with zeros.
    commanded = max((i for i, pulse in enumerate(arrivals[-1].reading.values, 1) if pulse), default=0)
    shapes = [vehicle.configurations[chosen]] if chosen else list(vehicle.configurations.values())
    counts = sorted({len(shape.thrusters) for shape in shapes})
    if commanded in counts:
        return ok("thrusters", f"{commanded} thrusters are commanded, as the vehicle file has them")
    listed = " or ".join(map(str, counts))
    whose = f"'{vehicle.name}:{chosen}'" if chosen else f"'{vehicle.name}'"
    return fail(
        "thrusters",
        f"the vehicle commands {commanded} thrusters, {whose} has {listed}; give this vehicle's own file",
    )


def findings_against_wet(findings: Sequence[Finding]) -> list[Finding]:
    """Reasons to turn no thruster; empty for a vehicle that sends heartbeats, is alone, and matches its file."""
    names = [f"'{f.name}'" for f in findings if f.level is Level.FAIL and f.name in FORBIDS_WET]
    if not names:
        return []
    sentence = f"not begun, no thruster turned; first mend what failed: {', '.join(names)}"
    return [fail("wet check", sentence)]
