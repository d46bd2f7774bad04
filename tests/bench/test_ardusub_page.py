"""The table of the firmware's dives."""

from bench.ardusub.page import BEGIN, END, page, table

PLANNED = {
    "hand_s": 804.0, "known_s": 100.5, "whole_s": 130.0, "identify_s": 6.0, "share": 0.051,
    "hand": {"M_u": 0.051, "M_w": 0.02}, "flown": {"M_u": 0.012, "M_w": float("inf")},
}  # fmt: skip
AXIS = {"mass": [17.0, 16.83, 16.6, 17.1], "drag": [0.33, 0.304, 0.29, 0.32], "speed": 0.063}


def test_the_table_says_how_far_off_each_value_is_and_which_interval_misses_the_truth():
    half = {"verdict": "explained", "causes": ["weak_thruster (gain 0.53)"]}
    after = {"after": {"verdict": "no_gap", "causes": []}}
    text = table({"plain": {"surge": AXIS}, "half": half | after, "planned": PLANNED})
    assert "| mass in surge | 17 kg | 16.8 (16.6 to 17.1) | -1.0 % |" in text
    assert "| drag in surge at 0.063 m/s | 0.33 N | 0.304 (0.29 to 0.32) | -7.9 %, outside |" in text
    assert (
        "| thruster 2 at half its thrust | explained: weak_thruster (gain 0.53) | no_gap: nothing |" in text
    )
    assert "| laps by sticks, all of them | 804 s | 5.1 | 2 |" in text
    assert "| `fly`, until the masses are known | 100 s | 1.2 | - |" in text
    assert "5.1 %; `fly` took 1/8.0 of their time" in text


def test_without_the_firmware_the_table_stays_and_the_reason_is_said(tmp_path, monkeypatch):
    monkeypatch.delenv("SEATRIAL_ARDUSUB", raising=False)
    kept = f"before {BEGIN}\nfigures\n{END} after"
    (tmp_path / "ardusub.md").write_text(kept)
    assert "needs SEATRIAL_ARDUSUB" in page(tmp_path, tmp_path)
    assert (tmp_path / "ardusub.md").read_text() == kept
