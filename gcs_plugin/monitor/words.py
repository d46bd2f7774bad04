"""A gap in words: by axis the drift over 5 s and its floor, in mm/s and mrad/s."""

from bridge.vehicle.coefficients import DOFS
from gcs_plugin.monitor.gap import AxisGap, Gap


def thousandths(axis: AxisGap) -> tuple[str, str, str]:
    """Drift, floor, and their unit."""
    return f"{1e3 * axis.drift:.1f}", f"{1e3 * axis.floor:.1f}", "mm/s" if axis.dof < 3 else "mrad/s"


def worst(gap: Gap) -> AxisGap | None:
    """The axis that is farthest beyond its floor."""
    return max(gap.axes, key=lambda axis: axis.drift / axis.floor, default=None)


def gap_line(gap: Gap) -> str:
    """The gap in a line: `off its model (floor): surge 5.6 (7.4) mm/s, yaw 1.1 (2.3) mrad/s`."""
    if not gap.axes:
        return f"its noise floor is learnt, {gap.learns_s:.0f} s more"
    parts = []
    for axis in gap.axes:
        drift, floor, unit = thousandths(axis)
        parts.append(f"{DOFS[axis.dof]} {drift} ({floor}) {unit}")
    return f"off its model (floor): {', '.join(parts)}"
