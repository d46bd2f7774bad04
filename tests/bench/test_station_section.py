"""The section on the way from a dive to a verified upload: both of its goals are judged."""

import pytest

from bench.station import table


@pytest.mark.parametrize(
    ("whole_s", "keys", "verdict"), [(59.9, 6, "met"), (60.1, 6, "missed"), (20.0, 7, "missed")]
)
def test_the_goal_is_met_with_few_keys_and_within_a_minute(whole_s: float, keys: int, verdict: str) -> None:
    lines = table({"reached": [15.0, 18.0, whole_s], "keys": keys, "lines": 12}, 807.0)
    assert lines[-2] == f"Goal of 6 keys and 60 s: {verdict}."
    assert f"| written and read back | {whole_s:.1f} |" in lines
    assert any("hovering dive of 807 s" in line for line in lines)
