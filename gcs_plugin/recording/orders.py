"""Orders to the running recording: begin the next dive, or end. Passed in a small file next to that of `state`.

A file is used, not a signal, since Windows has no signal that a process could handle and go on.
"""

import contextlib
import os
import time
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Final

from bridge.clock import Clock
from bridge.errors import LinkError, LogError
from bridge.files import write_whole
from gcs_plugin.recording.state import Holding, hangs, held, hung, state_file

PATIENCE_S: Final = 15.0
LOOK_EVERY_S: Final = 0.1
LEAST_DIVE_S: Final = 5.0
"""A key that is held down repeats itself: a dive that has only just begun is not followed by the next dive."""


class Order(Enum):
    """An order to the running recording; the value stands in its file."""

    NEXT = "next"
    END = "end"


def next_dive(
    clock: Clock, wait: Callable[[float], None] = time.sleep, *, soon: bool = False
) -> tuple[Path, Path]:
    """Order the running recording to go on in a new dive folder; return the old folder and the new.

    `soon`: a dive that has only just begun is waited for. Raises LinkError if no recording runs, if it hangs, has ended
    or stays in the old folder, or if the dive has only just begun; LogError if the order can't be written.
    """
    holding = _running(clock)
    lacks_s = LEAST_DIVE_S - holding.lasted_s(clock.unix_s())
    if soon and 0.0 < lacks_s <= LEAST_DIVE_S:
        wait(lacks_s)
    elif lacks_s > 0.0:
        raise LinkError(f"{holding.folder}: this dive has only just begun; ask again in {LEAST_DIVE_S:.0f} s")
    now = _obeyed(Order.NEXT, holding, clock, wait, lambda now: now.folder != holding.folder)
    if now is None:
        raise LinkError(f"the recording into {holding.folder} has ended, and the next dive is not recorded")
    return Path(holding.folder), Path(now.folder)


def end(clock: Clock, wait: Callable[[float], None] = time.sleep) -> Path:
    """End the running recording; return the folder of its dive.

    Raises LinkError if no recording runs, if it hangs or goes on; LogError if the order can't be written.
    """
    holding = _running(clock)
    _obeyed(Order.END, holding, clock, wait, lambda _: False)
    return Path(holding.folder)


def became(finished: Path, present: Path | None) -> str:
    """A sentence on a finished dive and on the recording after it."""
    after = f"the next dive goes into {present}" if present else "nothing is recorded any more"
    return f"{finished} {'is finished' if finished.exists() else 'is not kept, since nothing arrived in it'}; {after}"


def ordered() -> Order | None:
    """Take the order to this process since the last call, None if there is none."""
    file = _file(os.getpid())
    try:
        text = file.read_text(encoding="utf-8")
        file.unlink()
        return Order(text)
    except (OSError, ValueError):
        return None


def forget() -> None:
    """Delete an order left over for an earlier process with the same number."""
    with contextlib.suppress(OSError):
        _file(os.getpid()).unlink()


def _running(clock: Clock) -> Holding:
    holding = held(clock.unix_s())
    if holding is None:
        _refuse_hung(clock)
        raise LinkError("no recording runs; start `seatrial record`")
    return holding


def _refuse_hung(clock: Clock) -> None:
    """Raise LinkError if the recording hangs."""
    if (holding := hung(clock.unix_s())) is not None:
        raise LinkError(hangs(holding))


def _obeyed(
    order: Order,
    holding: Holding,
    clock: Clock,
    wait: Callable[[float], None],
    done: Callable[[Holding], bool],
) -> Holding | None:
    """Write the order and wait until it is `done`; return the recording's state then, None if it has ended.

    Raises LinkError if the recording hangs, or has not obeyed within PATIENCE_S.
    """
    file = _file(holding.pid)
    try:
        write_whole(file, order.value)
    except OSError as error:
        raise LogError(f"{file}: can't be written ({error.strerror}); check the disk") from None
    latest, until_s = holding, clock.boot_s() + PATIENCE_S
    try:
        while clock.boot_s() < until_s:
            wait(LOOK_EVERY_S)
            now = held(clock.unix_s())
            if now is None:
                _refuse_hung(clock)
            if now is None or now.pid != holding.pid:
                return None
            if done(now):
                return now
            latest = now
    finally:
        # An order not taken by then must not be carried out later, when nobody waits for it.
        with contextlib.suppress(OSError):
            file.unlink()
    last_notice = f"; its last word: {latest.notices[-1]}" if latest.notices else ""
    raise LinkError(
        f"process {latest.pid} was asked, and goes on recording into {latest.folder}{last_notice}"
    )


def _file(pid: int) -> Path:
    return state_file().with_name(f"recording.{pid}.asked")
