"""The section on opening a recording: every reader reads the same frames, and the goal is judged by their times."""

from pathlib import Path

import pytest
import yaml
from pymavlink.dialects.v20 import ardupilotmega as mav

from bench.reading import CAREFUL, HOUR, OURS, THEIRS, hour_lines, measured, table
from bridge.framing import Encoder


def test_all_readers_meet_the_same_frames(tmp_path: Path) -> None:
    encoder = Encoder(1, 1)
    data = b""
    for k in range(50):
        message = mav.MAVLink_attitude_message(100 * k, 0.0, 0.0, 0.5, 0.0, 0.0, 0.1)
        data += (1_790_000_000_000_000 + 100_000 * k).to_bytes(8, "big") + encoder.encode(message)
    log = tmp_path / "a.tlog"
    log.write_bytes(data)
    found = measured(log)
    assert found["messages"] == {OURS: 50, CAREFUL: 50, THEIRS: 50}
    assert found["bytes"] == len(data)
    assert min(found["seconds"].values()) > 0


@pytest.mark.parametrize(("ours_s", "said"), [(0.1, "40, met."), (0.4, "10, missed.")])
def test_the_goal_is_judged_by_the_ratio_to_pymavlink(ours_s: float, said: str) -> None:
    seconds = {OURS: ours_s, CAREFUL: 1.0, THEIRS: 4.0}
    lines = table({"bytes": 22_200_000, "messages": dict.fromkeys(seconds, 300_000), "seconds": seconds})
    assert lines[-2].endswith(said)
    assert f"| {CAREFUL} | 300000 | 1 | 3e+05 | 4 x |" in lines


def test_the_hours_mission_lasts_an_hour_and_its_line_tells_both_times() -> None:
    legs = yaml.safe_load(HOUR)["legs"]
    assert sum(leg["duration_s"] * leg["alternate"] for leg in legs) == 3600
    seconds = {OURS: 0.5, CAREFUL: 1.0, THEIRS: 16.0}
    lines = hour_lines({"bytes": 75e6, "messages": dict.fromkeys(seconds, 1_030_000), "seconds": seconds})
    assert " ".join(lines).startswith(
        "The recording of an hour, 1030000 messages in 75.0 MB, opens in 0.5 s;"
    )
    assert "takes 16 s, 32 times as long" in " ".join(lines)
