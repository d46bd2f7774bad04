"""The tables that `python -m bench ardusub` writes into docs/ardusub.md, from figures of the firmware's dives."""

import subprocess

import pytest

from bench.ardusub.flight import version_of
from bench.ardusub.page import BEGIN, END, answer_of, followed, page, table, with_block
from bridge.errors import FitError

MASSES = {"M_u": [17.0, 17.5, 17.1, 17.9], "M_w": [26.0, 26.1, 25.9, 26.3]}


def flight(known_s, **flown):
    return {"known_s": known_s, "identify_s": 6.0, "flown": flown, "masses": MASSES}


PLANNED = {
    "hand_s": 804.0, "share": 0.051, "hand": {"M_u": 0.051, "M_w": 0.02},
    "flights": {
        "widest": [flight(100.5, M_u=0.012, M_w=0.01), flight(80.4, M_u=0.011, M_w=float("inf"))],
        "each": [flight(201.0, M_u=0.01, M_w=0.01)],
    },
}  # fmt: skip
AXIS = {
    "mass": [[17.0, 16.83, 16.6, 17.1], [17.0, 17.17, 16.9, 17.4]],
    "drag": [[0.33, 0.304, 0.29, 0.32], [0.34, 0.34, 0.32, 0.36]],
    "speed": [0.063, 0.065],
}


def test_the_table_says_how_far_off_each_value_is_and_how_many_intervals_hold_the_truth():
    half = {"verdict": "explained", "causes": ["weak_thruster (gain 0.53)"]}
    log = {"log": {"verdict": "partly", "causes": ["weak_thruster (gain 0.51)"]}}
    after = {"after": {"verdict": "no_gap", "causes": []}}
    plain = {"axes": {"surge": AXIS}, "answers": [half, after["after"], after["after"]]}
    text = table({"plain": plain, "half": half | log | after, "planned": PLANNED})
    assert "| mass in surge | 17 kg | -1.0, +1.0 % | 1.5 % | 2 of 2 |" in text
    assert "| drag in surge at 0.063 m/s | 0.33 N | -7.9, +0.0 % | 5.9 % | 1 of 2 |" in text
    assert (
        "| thruster 2 at half its thrust | explained: weak_thruster (gain 0.53) | partly: weak_thruster (gain 0.51) "
        "| no_gap: nothing |" in text
    )
    nothing = "no_gap: nothing (2), explained: weak_thruster (gain 0.53) (1)"
    assert f"Of the 3 dives with nothing planted it says: {nothing}." in text
    assert "| laps by sticks, all of them | 804 s | 5.1 | 2 |" in text
    assert (
        "| `fly` until every mass is known to the widest of these, the worst of 2 flights | 100 s | 1.2 | - |"
        in text
    )
    assert "| `fly` until each mass is known as by laps, the worst of 1 flights | 201 s | 1 | 1 |" in text
    assert (
        "5.1 %: for that `fly` took 1/8.0 to 1/10.0 of their time, and for each mass as by laps 1/4.0 to 1/4.0"
        in text
    )
    assert "off by 2.9 % at most, and 3 of 6 of their intervals hold the truth." in text


def test_each_way_to_follow_the_sticks_stands_beside_the_sticks_alone():
    text = followed(
        {
            "off": {"sticks alone": [0.14, 0.12], "companion, `ff`": [0.01, 0.008]},
            "latest_s": 0.0214,
            "version": "4.5.7",
        }
    )
    assert "| sticks alone | 140.0 mm/s | 120.0 mm/s | 1/1.0, 1/1.0 |" in text
    assert "| companion, `ff` | 10.0 mm/s | 8.0 mm/s | 1/14.0, 1/15.0 |" in text
    assert text.endswith(
        "\n\nThe latest tick of the applet's script came after 21 ms. Flown with ArduSub 4.5.7."
    )


def test_where_the_firmware_keeps_overrides_the_page_says_that_the_applet_adds_nothing():
    text = followed({"off": {"sticks alone": [0.14, 0.12]}, "latest_s": None, "version": "4.5.0-beta"})
    assert text.endswith(
        "This firmware keeps overrides for ever: the applet adds nothing there. Flown with ArduSub 4.5.0-beta."
    )


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (0x040507FF, "4.5.7"),
        (0x04050080, "4.5.0-beta"),
        (0x04060182, "4.6.1-beta2"),
        (0x04070000, "4.7.0-dev"),
    ],
)
def test_the_firmwares_version_is_read_as_it_is_spoken(number, words):
    assert version_of(number) == words


def test_a_block_of_the_page_is_written_anew_and_the_rest_of_it_stays():
    assert with_block(f"a {BEGIN}\nold\n{END} b {END} c", BEGIN, "new") == f"a {BEGIN}\nnew\n{END} b {END} c"


def test_an_answer_of_an_earlier_run_is_not_taken_for_that_of_a_dive_that_is_refused(tmp_path, monkeypatch):
    (tmp_path / "identify.json").write_text("{}", encoding="utf-8")
    refused = subprocess.CompletedProcess([], 1)
    monkeypatch.setattr("bench.ardusub.page.subprocess.run", lambda *_, **__: refused)
    with pytest.raises(FitError, match="seatrial identify ended with 1"):
        answer_of("identify", tmp_path / "ring" / "dive.tlog")


def test_without_the_firmware_the_table_stays_and_the_reason_is_said(tmp_path, monkeypatch):
    monkeypatch.delenv("SEATRIAL_ARDUSUB", raising=False)
    kept = f"before {BEGIN}\nfigures\n{END} after"
    (tmp_path / "ardusub.md").write_text(kept)
    assert "needs SEATRIAL_ARDUSUB" in page(tmp_path, tmp_path)
    assert (tmp_path / "ardusub.md").read_text() == kept
