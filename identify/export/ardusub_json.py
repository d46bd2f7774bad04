"""ArduSub's simulator in the loop: a JSON file with the plant for its JSON backend and numbers for its own submarine.

ArduPilot reads no file of a submarine's dynamics. Sources: ArduPilot/ardupilot, libraries/SITL/SIM_Submarine.{h,cpp}
(its dynamics and the constants of `frame_property`, in the source), libraries/SITL/SIM_Frame.cpp (model files in JSON
are for multicopters), libraries/SITL/examples/JSON/readme.md (the JSON backend sends pulse widths and receives the
states of an external physics process), Tools/autotest/ardusub.py (a current is SIM_WIND_SPD with SIM_WIND_T 1).

`plant` is the whole model in SI units, body FRD, earth NED, as the backend has them. `parameters` must be set in
either case; `frame_property` goes into SIM_Submarine.h. SIM_Submarine.h computes drag as rho/2 A Cd v |v| with rho
1023.6 kg/m3 along the axes and 1000/2 A Cd r w |w| about them, A and r of its equivalent sphere of 0.2 m, and has
neither lag nor linear damping.
"""

import json
import math
from collections.abc import Sequence

from bridge.simulator.json_plant import PORT
from identify.export.model import DRAG_SPEED_M_S, KNOW, Model

SPHERE_M = 0.2
AREA_M2 = math.pi / 4 * math.pi ** (2 / 3) * SPHERE_M**2
"""pi/4 (3/4 V)^(2/3) of V = 4/3 pi r^3, as in SIM_Submarine.h."""
DENSITY_KG_M3, TURNING_DENSITY_KG_M3 = 1023.6, 1000.0
OWN_LINEAR_DRAG, OWN_TURNING_DRAG = (1.4, 1.8, 2.0), (1.05, 1.05, 1.05)
"""Drag coefficients built into SIM_Submarine.h."""

_UNDAMPED = (
    "`plant` is undamped there, and names it as unknown; `frame_property` keeps the drag that ArduSub's own submarine "
    f"has there; {KNOW}"
)
_SUBMARINE = "ArduSub's own submarine has {0}; the model's stands in `plant`"
REASONS = {
    "model": "ArduPilot reads no file of a submarine: `plant` is for the physics process that answers its JSON "
    "backend, `frame_property` for SIM_Submarine.h, which is then compiled",
    "lag": _SUBMARINE.format("no lag"),
    "thrusters": _SUBMARINE.format(
        "places and directions in its source, those of its frames vectored and vectored_6dof"
    ),
    "gain": _SUBMARINE.format("one thrust for all thrusters"),
    "reverse_gain": _SUBMARINE.format("the same thrust astern"),
    "dead_zone": _SUBMARINE.format("a dead zone of 25 us instead"),
    "least": _SUBMARINE.format("a dead zone of 25 us instead"),
    "effects": "neither ArduSub's own submarine nor `plant` has them; the rest of the model was fitted beside them",
    "curve": _SUBMARINE.format("a quadratic thrust curve of 400 us"),
    "mass_by_axis": _SUBMARINE.format("one mass for all directions: {model.mean_mass_words}, is written"),
    "unknown_mass": f"`plant` has the rigid body's own there, with no added mass, and names it as unknown; {KNOW}",
    "unknown_inertia": f"`plant` has the rigid body's own there, and names it as unknown; {KNOW}",
    "undamped_moving": _UNDAMPED,
    "undamped_turning": _UNDAMPED,
    "added": _SUBMARINE.format("no Coriolis force and no added mass but in its weight"),
    "moving_damping": _SUBMARINE.format("quadratic drag alone, which is written to be right at 0.5 m/s"),
    "turning_damping": _SUBMARINE.format(
        "quadratic drag alone about its axes too, written to be right at 0.5 rad/s, and one moment of inertia, "
        "computed from its mass"
    ),
    "righting": _SUBMARINE.format("a righting moment of 6 N m in its source"),
    "vertical_current": _SUBMARINE.format("currents along the horizon"),
}


def write(model: Model) -> str:
    data = {
        "vehicle": model.name,
        "backend": {
            "option": "--model JSON:127.0.0.1",
            "port": PORT,
            "frame": "body FRD, earth NED, SI units",
        },
        "parameters": _parameters(model),
        "frame_property": _frame_property(model),
        "plant": _plant(model),
    }
    return json.dumps(data, indent=2, allow_nan=False) + "\n"


def _parameters(model: Model) -> dict[str, float]:
    """ArduPilot parameters. Wind means current for a submarine, given by where it comes from, in degrees from north."""
    parameters = {"SIM_BUOYANCY": model.net_buoyancy_n}
    north, east, _ = model.current_m_s
    if north or east:
        parameters["SIM_WIND_SPD"] = math.hypot(north, east)
        parameters["SIM_WIND_DIR"] = math.degrees(math.atan2(-east, -north)) % 360.0
        parameters["SIM_WIND_T"] = 1.0
    return parameters


def _frame_property(model: Model) -> dict[str, object]:
    along = DENSITY_KG_M3 / 2 * AREA_M2
    about = TURNING_DENSITY_KG_M3 / 2 * AREA_M2 * SPHERE_M
    submarine_drag = (*OWN_LINEAR_DRAG, *OWN_TURNING_DRAG)
    whole = [q + linear / DRAG_SPEED_M_S for q, linear in zip(model.quadratic, model.linear, strict=True)]
    drag = [
        submarine_drag[i] if i in model.undamped else size / (along if i < 3 else about)
        for i, size in enumerate(whole)
    ]
    return {
        # `mass` divides SIM_BUOYANCY and `weight` every other force.
        "weight": model.mean_mass_kg,
        "mass": model.mean_mass_kg,
        "thrust": max(_column(model.curve, 1), default=0.0),
        "linear_drag_coefficient": drag[:3],
        "angular_drag_coefficient": drag[3:],
    }


def _plant(model: Model) -> dict[str, object]:
    return {
        "dry_mass_kg": model.dry_mass_kg,
        "inertia_kgm2": list(model.inertia_kgm2),
        "added_mass": list(model.added),
        "total_mass": list(model.total),
        "linear_damping": list(model.linear),
        "quadratic_damping": list(model.quadratic),
        "net_buoyancy_n": model.net_buoyancy_n,
        "centre_of_gravity_m": list(model.centre_of_gravity_m),
        "centre_of_buoyancy_m": list(model.centre_of_buoyancy_m),
        "current_m_s": list(model.current_m_s),
        "water_density_kg_m3": model.density_kg_m3,
        "thruster_lag_s": model.lag_s,
        "thrust_curve": {"pwm_us": _column(model.curve, 0), "thrust_n": _column(model.curve, 1)},
        "thrusters": [
            {
                "servo": i,
                "direction": list(t.direction),
                "position_m": list(t.position_m),
                "gain": t.gain,
                "reverse_gain": t.reverse_gain,
                "dead_zone_n": t.dead_zone_n,
                "least_n": t.least_n,
                "min_n": t.low_n,
                "max_n": t.high_n,
            }
            for i, t in enumerate(model.thrusters, start=1)
        ],
        "unknown": list(model.unknown),
        "intervals_95": {name: list(pair) for name, pair in model.intervals.items()},
    }


def _column(curve: Sequence[tuple[float, float]], column: int) -> list[float]:
    return [row[column] for row in curve]
