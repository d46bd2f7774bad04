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
from gcs_plugin.holder import Holding, held, state_file

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

    Raises LinkError where none runs, the dive has only just begun, or it does not go on elsewhere.
    """
    holding = _running(clock)
    if holding.lasted_s(clock.unix_s()) < LEAST_DIVE_S:
        raise LinkError(f"{holding.folder}: this dive has only just begun; ask again in {LEAST_DIVE_S:.0f} s")
    now = _obeyed(Order.NEXT, holding, clock, wait, lambda now: now.folder != holding.folder)
    if now is None:
        raise LinkError(f"the recording into {holding.folder} has ended, and the next dive is not recorded")
    return Path(holding.folder), Path(now.folder)


def end(clock: Clock, wait: Callable[[float], None]) -> Path:
    """End the recording that runs; the folder of its dive. Raises LinkError where none runs, or it goes on."""
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
        raise LinkError("no recording runs; start `seatrial record`")
    return holding


def _obeyed(
    order: Order,
    holding: Holding,
    clock: Clock,
    wait: Callable[[float], None],
    done: Callable[[Holding], bool],
) -> Holding | None:
    """Ask, and wait until it is done; what it tells then, None where it runs no more."""
    file = _file(holding.pid)
    partial = file.with_name(f"{file.name}.{os.getpid()}.part")
    try:
        partial.write_text(order.value, encoding="utf-8")
        partial.replace(file)
    except OSError as error:
        raise LogError(f"{file}: can't be written ({error.strerror}); check the disk") from None
    latest, until_s = holding, clock.boot_s() + PATIENCE_S
    try:
        while clock.boot_s() < until_s:
            wait(LOOK_EVERY_S)
            now = held(clock.unix_s())
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
