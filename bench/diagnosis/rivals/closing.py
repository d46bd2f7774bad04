"""How far a rival's model closes the gap on another dive of the vehicle, simulated as for the diagnosis."""

import numpy as np
from numpy.typing import NDArray

from bench.diagnosis.rivals.said import Said
from identify.diagnose.nominal import Nominal
from identify.diagnose.shrink import flight_of
from identify.diagnose.simulation import Simulation

Array = NDArray[np.float64]

HORIZON_S = 5.0


def closed(said: Said, nominal: Nominal, check: Nominal) -> tuple[Array, Array]:
    """Rms drifts (6,) after 5 s on the check dive, by the nominal model and with the rival's causes; m/s and rad/s.

    Masses, dampings and causes are those of the first dive; trims are the check dive's own, as for the diagnosis.
    """
    flight = flight_of(said.now, said.causes, nominal, check)
    return _drift(flight.before), _drift(flight.after)


def _drift(model: Simulation) -> Array:
    length = round(HORIZON_S / model.step_s)
    starts = np.arange(0, len(model.time_s) - length - 1, length)
    off = model.off(starts, [length], np.zeros_like(model.nu))[:, 0]
    return np.asarray(np.sqrt(np.mean(off**2, axis=0)))
