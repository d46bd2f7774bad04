"""Velocities that a DVL without bottom lock gives: exactly zero in all axes, amid a motion that goes on."""

from typing import Final

import numpy as np

from identify.dive import Signal

AMID: Final = 2.0
"""A zero is none where the velocities on both sides are larger than so many of the steps from one to the next."""
NEARLY_ALL: Final = 0.99
FEWEST, FEWEST_READ = 5, 100


def without_zeros(velocity: Signal, notes: list[str]) -> Signal:
    """The velocity (n, 3), unknown where it is such a zero; `notes` get a sentence on these."""
    axes = np.nan_to_num(velocity.value).any(axis=0)
    rows = np.flatnonzero(np.isfinite(velocity.value[:, axes]).all(axis=1))
    read = velocity.value[np.ix_(rows, axes)]
    size = np.linalg.norm(read, axis=1)
    moving = np.flatnonzero(size > 0.0)
    if len(moving) < FEWEST_READ:
        return velocity
    zero = np.arange(moving[0], moving[-1])
    zero = zero[size[zero] == 0.0]
    after = np.searchsorted(moving, zero)
    neighbour_speed = np.minimum(size[moving[after - 1]], size[moving[after]])
    steps = np.linalg.norm(np.diff(read[moving], axis=0), axis=1)
    none = zero[neighbour_speed > AMID * float(np.quantile(steps, NEARLY_ALL))]
    if len(none) < FEWEST:
        return velocity
    value = velocity.value.copy()
    value[rows[none]] = np.nan
    notes.append(
        f"{len(none)} of {len(velocity)} velocities are exactly zero in all axes, and those around them are not: taken "
        "for no reading, as of a DVL without bottom lock."
    )
    return Signal(velocity.time_s, value)
