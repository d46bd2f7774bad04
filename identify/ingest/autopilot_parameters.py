"""The autopilot's own parameters in a recording: PARAM_VALUE of a `.tlog`, PARM of a DataFlash `.BIN`."""

from pathlib import Path
from typing import Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LogError
from bridge.wire.tlog import SUFFIXES
from identify.ingest.dataflash import dataflash_parameters
from identify.ingest.frames import Fields, load_frames
from identify.ingest.open import recording_files

AUTOPILOT: Final = dialect.MAV_COMP_ID_AUTOPILOT1


def autopilot_parameters(path: Path) -> dict[str, float]:
    """Parameters by name, as a recording or a dive folder last states them; empty if it holds none.

    Raises LogError for another form of file, and for an autopilot that is no ArduPilot.
    """
    files = recording_files(path)
    logs = [file for file in files if file.name.lower().endswith(".bin")]
    heard = [file for file in files if file.name.lower().endswith(SUFFIXES)]
    if not logs and not heard:
        raise LogError(
            f"{path}: an autopilot's parameters are in a .tlog or a DataFlash .BIN; give one of these"
        )
    values = _heard(heard) if heard else {}
    for log in logs:
        values |= dataflash_parameters(log)
    return values


def _heard(files: list[Path]) -> dict[str, float]:
    """Values of the autopilot's own component. Raises LogError for an autopilot that is no ArduPilot."""
    frames = load_frames(files)
    rows = frames.rows("PARAM_VALUE")
    fields = Fields(frames, "PARAM_VALUE", rows[frames.component[rows] == AUTOPILOT])
    beats = frames.rows("HEARTBEAT")
    beating = Fields(frames, "HEARTBEAT", beats[frames.component[beats] == AUTOPILOT])
    kinds = np.unique(beating["autopilot"])
    if len(kinds) and dialect.MAV_AUTOPILOT_ARDUPILOTMEGA not in kinds:
        raise LogError(
            f"{files[0]}: its autopilot is no ArduPilot, and only ArduSub's parameters can be read; write a vehicle "
            "file (docs/howto/write_a_vehicle_file.md)"
        )
    return {
        name.decode("ascii", "replace"): float(value)
        for name, value in zip(fields["param_id"].tolist(), fields["param_value"].tolist(), strict=True)
    }
