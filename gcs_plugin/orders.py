"""What others ask of the recording that runs: the next dive, or its end. A small file beside that of `holder`.

A file, not a signal: Windows has none that a process could hear and go on.
"""

import contextlib
import os
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Final

from bridge.clock import Clock
from bridge.errors import LinkError, LogError
from bridge.new_file import whole
from gcs_plugin.holder import Holding, hangs, held, hung, state_file

PATIENCE_S: Final = 15.0
LOOK_EVERY_S: Final = 0.1
LEAST_DIVE_S: Final = 5.0
"""A key that is held down repeats itself: a dive that has only just begun is not ended by the next one."""


class Order(Enum):
    """What a recording can be asked for."""

    NEXT = "next"
    END = "end"


def next_dive(clock: Clock, wait: Callable[[float], None]) -> tuple[Path, Path]:
    """Let the recording that runs go on in a new dive folder; the folder before, and the new one.

    Raises LinkError where none runs, it hangs, the dive has only just begun, or it does not go on elsewhere.
    """
    holding = _running(clock)
    if holding.lasted_s(clock.unix_s()) < LEAST_DIVE_S:
        raise LinkError(f"{holding.folder}: this dive has only just begun; ask again in {LEAST_DIVE_S:.0f} s")
    now = _obeyed(Order.NEXT, holding, clock, wait, lambda now: now.folder != holding.folder)
    if now is None:
        raise LinkError(f"the recording into {holding.folder} has ended, and the next dive is not recorded")
    return Path(holding.folder), Path(now.folder)


def end(clock: Clock, wait: Callable[[float], None]) -> Path:
    """End the recording that runs; the folder of its dive.

    Raises LinkError where none runs, it hangs, or it goes on.
    """
    holding = _running(clock)
    _obeyed(Order.END, holding, clock, wait, lambda _: False)
    return Path(holding.folder)


def ordered() -> Order | None:
    """What this process was asked for since the last call."""
    file = _file(os.getpid())
    try:
        text = file.read_text(encoding="utf-8")
        file.unlink()
        return Order(text)
    except (OSError, ValueError):
        return None


def forget() -> None:
    """Take away what a process of the same number was asked for."""
    with contextlib.suppress(OSError):
        _file(os.getpid()).unlink()


def _running(clock: Clock) -> Holding:
    holding = held(clock.unix_s())
    if holding is None:
        _refuse_hung(clock)
        raise LinkError("no recording runs; start `seatrial record`")
    return holding


def _refuse_hung(clock: Clock) -> None:
    """Raise LinkError where the recording hangs."""
    if (holding := hung(clock.unix_s())) is not None:
        raise LinkError(hangs(holding))


def _obeyed(
    order: Order,
    holding: Holding,
    clock: Clock,
    wait: Callable[[float], None],
    done: Callable[[Holding], bool],
) -> Holding | None:
    """Ask, and wait until it is done; what it tells then, None where it runs no more."""
    file = _file(holding.pid)
    try:
        with whole(file) as made:
            made.write(order.value.encode())
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
        # What nobody took by then must not be done later, when nobody waits for it.
        with contextlib.suppress(OSError):
            file.unlink()
    said = f"; its last word: {latest.notices[-1]}" if latest.notices else ""
    raise LinkError(f"process {latest.pid} was asked, and goes on recording into {latest.folder}{said}")


def _file(pid: int) -> Path:
    return state_file().with_name(f"recording.{pid}.asked")
