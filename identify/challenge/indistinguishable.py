"""Effects that no method can tell apart in a recording, and so count as the same cause."""

from dataclasses import dataclass

from identify.challenge.planted_effects import ABSORBED


@dataclass(frozen=True)
class Alike:
    """Causes that count as the same, with the reason; `without_rpm`: only if no shaft speeds are recorded."""

    names: frozenset[str]
    reason: str
    without_rpm: bool = False


SAME = (
    Alike(
        frozenset({"command_delay", "thruster_lag"}),
        "a delay and a lag differ in the second order of a short time only: cosine 0.91 to 0.99, with shaft speeds "
        "too, unless the log is faster than 50 Hz",
    ),
    Alike(
        frozenset({"fouling", "battery_sag"}),
        "growing drag and falling thrust look alike (cosine 0.86 to 0.96) while nothing tells how fast the shafts turn",
        without_rpm=True,
    ),
    Alike(
        frozenset({"load_sag", "thrust_curve"}),
        "both change thrust by how hard is pushed (cosine 0.93 to 0.99) while nothing tells how fast the shafts turn",
        without_rpm=True,
    ),
    Alike(
        frozenset({"net_buoyancy", "thrust_bias"}),
        "a vehicle that stays level can't tell weight from a constant push down",
    ),
    Alike(frozenset(ABSORBED), "each is taken up by a refit of masses and dampings, and shows in nothing else"),
)  # fmt: skip


def alike(name: str, rpm: bool) -> frozenset[str]:
    """Names that no method could distinguish from `name` in such a recording, `name` included."""
    out = {name}
    for group in SAME:
        if name in group.names and not (group.without_rpm and rpm):
            out |= group.names
    return frozenset(out)
