"""Removes copies of velocities that are sent faster than they are measured; only the first copy is a reading.

A likelihood that takes each copy for an independent reading concludes that the velocity stands still between
readings. Chance, a coarse resolution and a vehicle at rest repeat values too, but never nearly all of them equally
often.
"""

from dataclasses import replace

import numpy as np

from identify.dive import Dive, Signal

LEAST_SHARE = 0.8
"""Least share of runs of equal values that have the same length: lost readings and chance make a few others."""

FEWEST_RUNS = 20


def without_repeated(dive: Dive) -> Dive:
    """If velocities each come equally often, the dive with only the first of each, and a note.

    The sensor's rate need not divide the rate at which its values are sent: a run may also be one longer than usual.
    """
    if dive.velocity is None:
        return dive
    known = np.isfinite(dive.velocity.value).all(axis=1)
    read = dive.velocity.value[known]
    if len(read) < 2:
        return dive
    first = np.flatnonzero(np.concatenate([[True], (read[1:] != read[:-1]).any(axis=1)]))
    lengths = np.diff(first, append=len(read))
    if len(first) < FEWEST_RUNS or np.mean(lengths > 1) <= LEAST_SHARE:
        return dive
    usual = int(np.median(lengths))
    share = max(np.mean((lengths == usual + by) | (lengths == usual + by + 1)) for by in (-1, 0))
    if share <= LEAST_SHARE:
        return dive
    copies = np.flatnonzero(known)[np.setdiff1d(np.arange(len(read)), first)]
    left = Signal(np.delete(dive.velocity.time_s, copies), np.delete(dive.velocity.value, copies, axis=0))
    note = (
        f"Each velocity comes {len(read) / len(first):.2g} times over: they are passed on at "
        f"{dive.velocity.rate_hz:.0f} Hz and measured at a part of that, so only the first of each is taken for a "
        "reading."
    )
    return replace(dive, velocity=left, notes=(*dive.notes, note))
