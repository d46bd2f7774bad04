"""The autopilot's own parameters in a recording: PARAM_VALUE of a `.tlog`, PARM of a DataFlash `.BIN`."""

from pathlib import Path

import numpy as np

from bridge.errors import LogError
from bridge.firmware import table
from bridge.firmware.ardusub import ARDUSUB
from bridge.firmware.description import AUTOPILOT, Firmware
from bridge.wire.tlog import SUFFIXES
from identify.ingest.mavlink.dataflash import dataflash_parameters
from identify.ingest.mavlink.frames import Fields, load_frames
from identify.ingest.open import recording_files


def autopilot_parameters(path: Path) -> tuple[Firmware, dict[str, float]]:
    """An autopilot's firmware, and its parameters by name, as a recording or a dive folder last states them; none if it
    holds none. Without a heartbeat the firmware is taken for the first of the table.

    Raises LogError for another form of file, and for an autopilot that is not supported.
    """
    files = recording_files(path)
    logs = [file for file in files if file.name.lower().endswith(".bin")]
    heard = [file for file in files if file.name.lower().endswith(SUFFIXES)]
    if not logs and not heard:
        raise LogError(
            "an autopilot's parameters are in a .tlog or a DataFlash .BIN; give one of these", path
        )
    firmware, values = _heard(heard) if heard else (ARDUSUB, {})
    for log in logs:
        values |= dataflash_parameters(log)
    return firmware, values


def _heard(files: list[Path]) -> tuple[Firmware, dict[str, float]]:
    """Firmware and values of the autopilot's own component, with those that a ground station logged under another where
    its own list was not heard. Raises LogError for one that is not supported."""
    frames = load_frames(files)
    beats = frames.rows("HEARTBEAT")
    beating = Fields(frames, "HEARTBEAT", beats[frames.component[beats] == AUTOPILOT])
    kinds = np.unique(beating["autopilot"])
    firmware = next((each for each in table.FIRMWARES if each.autopilot in kinds or not len(kinds)), None)
    if firmware is None:
        families = " or ".join(each.family for each in table.FIRMWARES)
        names = " and ".join(f"{each.name}'s" for each in table.FIRMWARES)
        raise LogError(
            f"its autopilot is no {families}, and only {names} parameters can be read; write a vehicle "
            "file (docs/howto/write_a_vehicle_file.md)",
            files[0],
        )
    rows = frames.rows("PARAM_VALUE")
    senders = frames.component[rows]
    values = _values(Fields(frames, "PARAM_VALUE", rows[senders == AUTOPILOT]))
    if firmware.frame in values:
        return firmware, values
    # MAVProxy fetches the whole list as a file, and logs it as parameters of another component.
    of_others = (
        _values(Fields(frames, "PARAM_VALUE", rows[senders == sender])) for sender in np.unique(senders)
    )
    logged = next((each for each in of_others if firmware.frame in each), {})
    return firmware, logged | values


def _values(fields: Fields) -> dict[str, float]:
    return {
        name.decode("ascii", "replace"): float(value)
        for name, value in zip(fields["param_id"].tolist(), fields["param_value"].tolist(), strict=True)
    }
