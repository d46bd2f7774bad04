"""Locked answers and the judging of those that were given."""

import hashlib
import json
import os
import signal
from dataclasses import replace
from pathlib import Path

import pytest

from bridge import exit_codes
from bridge.errors import LogError
from identify.challenge.answer import answer_of, errors, read_answer
from identify.challenge.case import draw_case, left_out
from identify.challenge.novel_effects import NOVEL
from identify.challenge.score import Rate, score
from identify.challenge.seal import hash_path, key_path, locked, read_key, seal, unsealed, write_key
from tui.cli import main


def truth(name, kind, *effects, rpm=True, size=2.0, number=0):
    planted = [
        {
            "name": effect,
            "number": number,
            "novel": kind == "novel",
            "drawn": 0.5,
            "size": size,
            "parameters": {"delay": 0.1},
        }
        for effect in effects
    ]
    return {
        "name": name,
        "kind": kind,
        "rpm": rpm,
        "poles": 1 + (name > "a"),
        "effects": planted,
        "size": size,
        "dof": ["surge"],
    }


def answer(verdict, *names, also=(), dof="surge", probability=0.9, parameters=None, shrink=None, drifts=None):
    effects = [
        {"name": name, "also": list(also), "probability": probability, "parameters": parameters or {}}
        for name in names
    ]
    held = None if shrink is None else {"value": shrink[0]}
    check = None if shrink is None else {"value": shrink[1]}
    if drifts is not None:
        check = {"value": None, "before": drifts[0], "after": drifts[1]}
    shares = [(dof, "steady", 0.3), (dof, "turning", 0.3), ("yaw", "steady", 0.4)]
    where = [{"dof": at, "phase": phase, "share": share} for at, phase, share in shares]
    return answer_of(
        {
            "verdict": verdict,
            "gap": {"where": where},
            "effects": effects,
            "shrink": {"heldout": held, "check": check},
        }
    )


def judged(*pairs):
    answers = {hidden["name"]: given for hidden, given in pairs if given is not None}
    return score([hidden for hidden, _ in pairs], answers)


def hits(result, beginning):
    rate = of(result.rates, beginning)
    return rate.hits, rate.of


def of(values, words):
    """The value of the measure whose sentence is, or begins with, these words."""
    by_sentence = {measure.value: value for measure, value in values.items()}
    (value,) = (
        [by_sentence[words]]
        if words in by_sentence
        else [value for sentence, value in by_sentence.items() if sentence.startswith(words)]
    )
    return value


def test_a_cause_counts_by_its_name_or_its_true_class():
    result = judged(
        (truth("a", "one", "tether"), answer("explained", "tether")),
        (truth("b", "one", "tether"), answer("explained", "waves")),
        (truth("c", "one", "thruster_lag"), answer("explained", "command_delay")),
        (truth("d", "one", "fouling", rpm=False), answer("explained", "battery_sag")),
        (truth("e", "one", "fouling", rpm=True), answer("explained", "battery_sag")),
        (truth("f", "one", "waves"), answer("ambiguous", "tether", also=("waves", "dead_zone"))),
    )
    assert hits(result, "one hidden: named first") == (3, 6)
    assert hits(result, "one hidden: named first, or called equally likely") == (4, 6)
    assert of(result.numbers, "mean class size") == pytest.approx((5 * 1 + 3) / 6)


def test_of_causes_named_for_one_that_hides_only_the_first_counts():
    delay = {"delay": {"value": 0.12, "unit": "s", "low95": 0.09, "high95": 0.15}}
    result = judged(
        (truth("a", "one", "dvl_delay"), answer("explained", "dvl_delay", "waves", parameters=delay)),
        (truth("b", "one", "dvl_delay"), answer("explained", "waves", "dvl_delay", parameters=delay)),
        (truth("c", "one", "dvl_delay"), answer("explained", "waves", "tether", parameters=delay)),
    )
    assert hits(result, "one hidden: named first") == (1, 3)
    assert hits(result, "one hidden: named first, or called equally likely") == (1, 3)
    assert hits(result, "one hidden, 0.5 or more") == (1, 3)
    assert hits(result, "magnitudes within their 95 % intervals") == (1, 1)
    (row,) = result.effects
    assert row.rate == Rate(1, 3)


def test_a_degree_of_freedom_is_right_where_the_largest_share_of_the_gap_is_told():
    """Six tenths are told in surge, in two phases, and four in yaw."""
    assert answer("explained").dofs == {"surge": 0.6, "yaw": 0.4}
    cases = [
        (["surge"], True), (["yaw", "surge"], True), (["yaw"], False), (["heave", "yaw"], False), (["sway"], False)
    ]  # fmt: skip
    for name, (dofs, right) in zip("abcde", cases, strict=True):
        result = judged((truth(name, "one", "waves") | {"dof": dofs}, answer("explained", "waves")))
        assert hits(result, "right degree of freedom") == (int(right), 1)
        assert hits(result, "where a gap is told: right degree") == (int(right), 1)


def test_a_weak_thruster_counts_only_with_its_number():
    right, wrong = ({"thruster": {"value": number, "unit": "1"}} for number in (3.0, 4.0))
    result = judged(
        (
            truth("a", "one", "weak_thruster", number=3),
            answer("explained", "weak_thruster", parameters=right),
        ),
        (
            truth("b", "one", "weak_thruster", number=3),
            answer("explained", "weak_thruster", parameters=wrong),
        ),
    )
    assert hits(result, "one hidden: named first") == (1, 2)


@pytest.mark.parametrize(
    ("number", "right"), [(None, 1), (float("inf"), 0), (2.5, 0), (2.6, 1), (3.4, 1), (3.5, 0)]
)
def test_a_thruster_without_a_number_is_any_and_others_are_those_that_their_numbers_are_nearest_to(
    number, right
):
    told = {"thruster": {"value": number, "unit": "1"}}
    hidden = truth("a", "one", "weak_thruster", number=3)
    told["delay"] = {"value": 0.1, "low95": 0.0, "high95": 0.2}
    result = judged((hidden, answer("explained", "weak_thruster", parameters=told)))
    assert hits(result, "one hidden: named first") == (right, 1)
    assert hits(result, "magnitudes within their 95 % intervals") == (right, right)


def test_both_of_two_need_a_cause_each():
    result = judged(
        (truth("a", "two", "waves", "tether"), answer("explained", "tether", "waves")),
        (truth("b", "two", "waves", "tether"), answer("explained", "tether")),
        (truth("c", "two", "waves", "tether"), answer("explained", "tether", also=("waves",))),
        (truth("d", "two", "waves", "tether"), None),
        (truth("e", "two", "waves", "tether"), answer("explained", "waves", "dead_zone")),
        (truth("f", "two", "waves", "tether"), answer("explained", "dead_zone", "tether", "waves")),
    )
    assert hits(result, "two hidden: both") == (2, 6)
    assert of(result.numbers, "causes named that do not hide, a case") == 2 / 5
    assert result.unanswered == ("d",)


def test_of_two_a_refit_takes_up_the_pair_only_if_it_takes_up_each():
    for other, both in (("dvl_scale", 0), ("waves", 1)):
        result = judged((truth("a", "two", "thrust_gain", other), answer("explained", "thrust_gain", other)))
        assert hits(result, "two hidden: both") == (both, both)


def test_pairs_of_which_one_is_too_small_to_show_are_counted_apart_too():
    small = truth("b", "two", "waves", "tether")
    small["effects"][1]["size"] = 0.4
    result = judged(
        (truth("a", "two", "waves", "tether"), answer("explained", "tether", "waves")),
        (small, answer("explained", "waves")),
    )
    assert hits(result, "two hidden: both") == (1, 2)
    assert hits(result, "two hidden, each 0.5 or more") == (1, 1)


def test_verdicts_are_counted_where_they_belong():
    result = judged(
        (truth("a", "none"), answer("no_gap")),
        (truth("b", "none"), answer("explained", "waves")),
        (truth("c", "novel", "knocks"), answer("unknown")),
        (truth("d", "novel", "knocks"), answer("explained", "waves", dof="sway")),
        (truth("e", "one", "waves"), answer("unknown")),
        (truth("f", "two", "waves", "tether"), answer("no_gap", dof="sway")),
        (truth("g", "one", "thrust_gain"), answer("no_gap")),
        (truth("h", "one", "thrust_gain"), answer("explained", "dvl_scale")),
        (truth("i", "one", "thrust_gain"), answer("explained", "waves")),
        (truth("j", "none"), answer("no_gap")),
        (truth("k", "novel", "knocks", size=0.4), answer("explained", "waves")),
        (truth("l", "novel", "knocks", size=0.5), answer("no_gap")),
        (truth("m", "one", "waves"), answer("explained", "waves")),
        (truth("n", "one", "thrust_gain"), answer("no_gap")),
    )
    assert hits(result, "false alarms where nothing") == (1, 3)
    assert hits(result, "false alarms where the disturbance") == (0, 1)
    assert hits(result, "unknown called unknown") == (1, 4)
    assert hits(result, "unknown, 0.5 or more over the floor: called unknown") == (1, 3)
    assert hits(result, "unknown: called no gap") == (1, 4)
    assert hits(result, "known called unknown") == (1, 3)
    assert hits(result, "known called no gap") == (1, 3)
    assert hits(result, "taken up by a refit") == (3, 4)
    assert hits(result, "right degree of freedom") == (5, 7)
    assert hits(result, "where a gap is told: right degree") == (4, 5)
    assert hits(result, "one hidden: named first") == (1, 2)
    assert hits(result, "without an answer") == (0, 14)


def test_an_answer_that_is_missing_is_no_false_alarm_and_is_counted_by_itself():
    result = judged((truth("a", "none"), answer("explained", "waves")), (truth("b", "none"), None))
    assert hits(result, "false alarms where nothing") == (1, 1)
    assert hits(result, "false alarms where the disturbance") == (1, 1)
    assert hits(result, "without an answer") == (1, 2)


def test_sizes_of_the_named_and_the_missed_are_told_by_effect():
    result = judged(
        (truth("a", "one", "waves", size=0.4), answer("no_gap")),
        (truth("b", "one", "waves", size=0.7), answer("explained", "waves")),
        (truth("c", "one", "waves", size=3.0), answer("explained", "waves")),
        (truth("d", "one", "waves", size=0.3), answer("no_gap")),
    )
    (waves,) = result.effects
    assert (waves.rate, waves.smallest_found, waves.largest_missed) == (Rate(2, 4), 0.7, 0.4)
    assert hits(result, "one hidden, 0.5 or more") == (2, 2)


def test_magnitudes_and_shrinks_are_held_beside_the_truth():
    delay = {"delay": {"value": 0.12, "unit": "s", "low95": 0.09, "high95": 0.15}}
    result = judged(
        (
            truth("a", "one", "dvl_delay"),
            answer("explained", "dvl_delay", parameters=delay, shrink=(0.9, 0.86), probability=0.8),
        )
    )
    assert of(result.numbers, "magnitude error, median") == pytest.approx(0.2)
    inside = of(result.rates, "magnitudes within their 95 % intervals")
    assert (inside.hits, inside.of) == (1, 1)
    assert of(result.numbers, "predicted less measured shrink, mean size") == pytest.approx(0.04)
    assert of(result.numbers, "calibration error of probabilities") == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("low", "high", "counted"),
    [(0.1, 0.2, (1, 1)), (0.0, 0.1, (1, 1)), (0.11, 0.2, (0, 1)), (0.0, None, (0, 0)), (None, 0.2, (0, 0))],
)
def test_a_magnitude_is_within_its_interval_at_the_ends_too_and_counts_only_with_both(low, high, counted):
    delay = {"delay": {"value": 0.12, "low95": low, "high95": high}}
    result = judged((truth("a", "one", "dvl_delay"), answer("explained", "dvl_delay", parameters=delay)))
    assert hits(result, "magnitudes within their 95 % intervals") == counted
    assert of(result.numbers, "magnitude error, median") == pytest.approx(0.2)


def test_probabilities_are_held_beside_what_was_right_in_tenths():
    """In the fifth tenth 0.9 are told and one is right, in the sixth 0.52 and none, in the ninth 0.85 and one, in the
    last 1.96 and one."""
    told = [
        (0.0, False),
        (0.42, True),
        (0.48, False),
        (0.52, False),
        (0.85, True),
        (0.96, True),
        (1.0, False),
    ]
    result = judged(
        *(
            (truth(name, "one", "waves"), answer("explained", "waves" if right else "tether", probability=p))
            for name, (p, right) in zip("abcdefg", told, strict=True)
        )
    )
    assert of(result.numbers, "calibration error of probabilities") == pytest.approx(
        (0.1 + 0.52 + 0.15 + 0.96) / 7
    )


def test_magnitudes_of_pairs_are_counted_apart_from_those_of_single_causes():
    delay = {"delay": {"value": 0.12, "unit": "s", "low95": 0.11, "high95": 0.13}}
    both = answer("explained", "waves", "dvl_delay", parameters=delay)
    single = answer("explained", "waves", parameters=delay)
    pair = truth("a", "two", "dvl_delay", "waves")
    result = judged((pair, both), ({**pair, "name": "b"}, single))
    assert of(result.numbers, "two hidden: magnitude error, median") == pytest.approx(0.2)
    pairs = of(result.rates, "two hidden: magnitudes within their 95 % intervals")
    assert (pairs.hits, pairs.of) == (0, 3)
    assert of(result.rates, "magnitudes within their 95 % intervals").of == 0
    assert of(result.numbers, "magnitude error, median") is None


def test_an_error_counts_from_where_the_effect_is_absent_and_by_the_length_of_a_vector():
    gain = answer("explained", "weak_thruster", parameters={"gain": {"value": 0.85, "unit": "1"}}).named[0]
    assert errors({"gain": 0.8, "thruster": 2.0}, gain) == {"gain": pytest.approx(0.25)}
    place = {"north": {"value": 0.0, "unit": "m/s"}, "east": {"value": 0.04, "unit": "m/s"}}
    current = answer("explained", "steady_current", parameters=place).named[0]
    assert errors({"north": 0.03, "east": 0.04}, current) == pytest.approx({"north": 0.6, "east": 0.0})


@pytest.mark.parametrize(
    ("name", "absent"),
    [("gain", 1.0), ("scale", 1.0), ("ratio", 1.0), ("time_constant", 0.03), ("delay", 0.0)],
)
def test_a_magnitude_s_error_is_told_by_how_far_the_effect_is_from_none(name, absent):
    for away, counted in ((0.05, {name: pytest.approx(0.4)}), (0.0, {})):
        told = {name: {"value": absent + away + 0.02}}
        named = answer("explained", "thruster_lag", parameters=told).named[0]
        assert errors({name: absent + away}, named) == counted


@pytest.mark.parametrize(
    ("drifts", "closed"),
    [
        ([(5.0, 1.4), (1.5, 1.5), (0.8, 0.8), (2.0, None), (None, 2.0)], 3.6 / 4.5),
        ([(1.5, 1.2)], 0.6),
        ([(1.0, 0.9)], None),
    ],
)
def test_the_gap_that_is_closed_is_pooled_over_check_dives(drifts, closed):
    result = judged(
        *(
            (truth(f"{n}", "one", "waves"), answer("explained", "waves", drifts=drift))
            for n, drift in enumerate(drifts)
        )
    )
    share = of(result.numbers, "share of all gaps on check dives that is closed")
    assert share == (None if closed is None else pytest.approx(closed))


def test_a_shrink_is_predicted_well_or_badly_where_there_is_a_gap_to_close():
    wide = replace(answer("explained", "waves", shrink=(0.9, 0.8)), before=2.0)
    narrow = replace(answer("explained", "waves", shrink=(0.9, 0.1)), before=1.1)
    result = judged((truth("a", "one", "waves"), wide), (truth("b", "one", "waves"), narrow))
    (apart,) = [
        value for measure, value in result.numbers.items() if measure.value.endswith("floors or more")
    ]
    assert apart == pytest.approx(0.1)
    assert of(result.numbers, "predicted less measured shrink, mean size") == pytest.approx(0.45)


def test_what_is_left_out_of_the_library_is_unknown_and_hides_nowhere_else():
    lacking = left_out("thruster_lag")
    assert lacking == ("command_delay", "thruster_lag")
    assert draw_case(300_400, names=["thruster_lag"], without=lacking).kind == "novel"
    drawn = [draw_case(300_400 + i, without=lacking) for i in range(60)]
    hidden = {case.kind: set() for case in drawn}
    for case in drawn:
        hidden[case.kind] |= {planted.name for planted in case.planted}
    assert hidden["novel"] & set(lacking)
    assert hidden["novel"] - set(lacking) <= set(NOVEL)
    assert not (hidden["one"] | hidden["two"]) & set(lacking)
    for name in ("thrust_gain", "knocks"):
        with pytest.raises(LogError, match="no effect that can be planted as unknown"):
            left_out(name)


def test_wilson_bounds_are_those_of_the_book():
    assert Rate(0, 0).bounds() == (0.0, 1.0)
    low, high = Rate(8, 10).bounds()
    assert (low, high) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert Rate(0, 300).bounds()[1] == pytest.approx(0.01264, abs=1e-5)


def test_what_is_no_answer_is_refused_by_name(tmp_path):
    path = tmp_path / "case_001.json"
    assert read_answer(path) is None
    cause = {"name": "waves", "also": [], "probability": 0.9, "parameters": {}}
    whole = {
        "verdict": "no_gap",
        "gap": {"where": []},
        "effects": [cause],
        "shrink": {"heldout": None, "check": None},
    }
    odd = [
        whole | {"gap": {"where": [{"dof": "surge", "share": 10**400}]}},
        *(
            whole | {"effects": [cause | part]}
            for part in ({"name": []}, {"also": [{}]}, {"probability": 1.01}, {"probability": -0.01})
        ),
        whole | {"verdict": "perhaps"},
    ]
    path.write_text(json.dumps(whole), encoding="utf-8")
    assert read_answer(path).named[0].name == "waves"
    for data in (b"\xff", None):
        if data is None:
            path.unlink()
            path.mkdir()
        else:
            path.write_bytes(data)
        with pytest.raises(LogError, match=r"case_001\.json: can't be read"):
            read_answer(path)
    path.rmdir()
    for text in ("{", "[]", '{"verdict": "perhaps"}', '{"verdict": "no_gap"}', *map(json.dumps, odd)):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(LogError, match=r"case_001\.json: is no answer of diagnose"):
            read_answer(path)


@pytest.fixture(scope="module")
def sealed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hidden") / "cases"
    return folder, seal(folder, 1, 31, "a key", lambda *_: None)


def test_sealing_locks_the_answers_under_a_hash_that_opens_them(sealed):
    folder, digest = sealed
    assert {path.name for path in (folder / "case_001").iterdir()} == {
        "dive.tlog",
        "check.tlog",
        "vehicle.yaml",
    }
    assert hash_path(folder).read_text(encoding="utf-8").split()[0] == digest
    assert unsealed(folder)[0]["name"] == unsealed(folder, digest)[0]["name"] == "case_001"
    assert b"310001" not in (folder / "case_001" / "dive.tlog").read_bytes()
    assert "310001" not in (folder / "case_001" / "vehicle.yaml").read_text(encoding="utf-8")


def test_a_folder_whose_name_is_no_text_is_sealed_too(tmp_path, monkeypatch):
    monkeypatch.setattr("identify.challenge.seal._write", lambda folder, _: folder.mkdir())
    monkeypatch.setattr("identify.challenge.case.Case.truth", lambda case: {"name": case.name})
    folder = tmp_path / os.fsdecode(b"hidden-\xff")
    digest = seal(folder, 1, 31, "a key", lambda *_: None)
    assert unsealed(folder, digest) == [{"name": "case_001"}]


def test_an_existing_folder_is_never_sealed_over(sealed, tmp_path):
    with pytest.raises(LogError, match="exists already"):
        seal(sealed[0], 1, 31, "a key", lambda *_: None)
    with pytest.raises(LogError, match="exists already"):
        seal(tmp_path, 1, 31, "a key", lambda *_: None)
    assert [*tmp_path.iterdir()] == []


@pytest.mark.parametrize("place", ["identify.challenge.seal._write", "identify.challenge.seal.write_whole"])
@pytest.mark.parametrize("ended", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_sealing_that_is_cut_short_leaves_nothing_that_blocks_the_next(tmp_path, monkeypatch, place, ended):
    monkeypatch.setattr("identify.challenge.case.Case.truth", lambda case: {"name": case.name})
    monkeypatch.setattr("identify.challenge.seal._write", lambda folder, _: folder.mkdir())
    folder = tmp_path / "cases"

    def cut(*_):
        raise ended

    with monkeypatch.context() as short:
        short.setattr(place, cut)
        with pytest.raises((LogError, KeyboardInterrupt)):
            seal(folder, 1, 31, "a key", lambda *_: None)
    assert [*tmp_path.iterdir()] == []
    digest = seal(folder, 1, 31, "a key", lambda *_: None)
    assert {path.name for path in tmp_path.iterdir()} == {"cases", "cases.key", "cases.sha256"}
    assert unsealed(folder, digest) == [{"name": "case_001"}]


def test_the_hash_of_sealed_answers_is_there_only_once_they_are(tmp_path, monkeypatch):
    monkeypatch.setattr("identify.challenge.case.Case.truth", lambda case: {"name": case.name})
    folder = tmp_path / "cases"
    there = []
    monkeypatch.setattr("identify.challenge.seal._write", lambda made, _: made.mkdir())
    monkeypatch.setattr(
        "identify.challenge.seal.write_whole", lambda *_: there.append((folder / "answers.sealed").exists())
    )
    seal(folder, 1, 31, "a key", lambda *_: there.append(folder.exists()))
    assert there == [False, True]


def test_a_signal_that_ends_the_sealing_is_told_and_leaves_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("identify.challenge.seal._write", lambda *_: os.kill(os.getpid(), signal.SIGTERM))
    before = signal.signal(signal.SIGTERM, lambda *_: None)
    words = ["challenge", "seal", "--cases", "1", "--seed", "7", "--out", str(tmp_path / "cases")]
    try:
        assert main(words) == exit_codes.INTERRUPTED
    finally:
        signal.signal(signal.SIGTERM, before)
    assert "stopped before it was done" in capsys.readouterr().err
    assert [*tmp_path.iterdir()] == []


def test_nothing_in_the_folder_says_what_hides_and_the_key_is_its_owners(sealed):
    folder, _ = sealed
    assert {path.name for path in folder.iterdir()} == {"case_001", "answers.sealed"}
    data = (folder / "answers.sealed").read_bytes()
    assert b"cases" not in data
    assert b"case_001" not in data
    assert key_path(folder).stat().st_mode & 0o777 == 0o600


def copied(sealed, into):
    """A sealed folder's answers, key and hash somewhere else."""
    folder = into / "copy"
    folder.mkdir()
    (folder / "answers.sealed").write_bytes((sealed[0] / "answers.sealed").read_bytes())
    for of in (key_path, hash_path):
        of(folder).write_bytes(of(sealed[0]).read_bytes())
    return folder


def test_changed_answers_are_not_scored(sealed, tmp_path):
    folder = copied(sealed, tmp_path)
    assert unsealed(folder) == unsealed(sealed[0])
    with (folder / "answers.sealed").open("ab") as file:
        file.write(b" ")
    with pytest.raises(LogError, match="the answers were changed after sealing"):
        unsealed(folder)
    with pytest.raises(LogError, match="give a folder of challenge seal"):
        unsealed(tmp_path / "nowhere")


def test_a_sealed_folder_is_opened_from_within_it_too(sealed, tmp_path, monkeypatch):
    folder = copied(sealed, tmp_path)
    (folder / "case_001").mkdir()
    monkeypatch.chdir(folder)
    assert unsealed(Path(".")) == unsealed(sealed[0])
    monkeypatch.chdir(folder / "case_001")
    assert unsealed(Path("..")) == unsealed(sealed[0])


def test_answers_that_were_changed_with_their_hash_are_not_those_that_were_published(sealed, tmp_path):
    folder = copied(sealed, tmp_path)
    other = locked(b'{"cases": []}', read_key(key_path(folder)))
    (folder / "answers.sealed").write_bytes(other)
    hash_path(folder).write_text(hashlib.sha256(other).hexdigest(), encoding="utf-8")
    assert unsealed(folder) == []
    with pytest.raises(LogError, match="the answers were changed after sealing"):
        unsealed(folder, sealed[1])


def test_a_key_opens_what_it_locked_and_nothing_else(sealed, tmp_path):
    assert locked(locked(b"to be hidden " * 9, "a"), "a") == b"to be hidden " * 9
    wrong = tmp_path / "wrong.key"
    write_key(wrong, "another")
    with pytest.raises(LogError, match=r"wrong\.key: does not open .*answers\.sealed"):
        unsealed(sealed[0], key=wrong)
    with pytest.raises(LogError, match="holds no key"):
        unsealed(sealed[0], key=tmp_path / "none.key")


def test_the_command_scores_a_folder_of_answers(sealed, tmp_path, capsys):
    line = [
        "challenge",
        "score",
        str(sealed[0]),
        "--answers",
        str(tmp_path),
        "--json",
        str(tmp_path / "out.json"),
    ]
    assert main(line) == 2
    assert "holds no answer to any case" in capsys.readouterr().err
    (tmp_path / "case_001.json").write_text(100_000 * "[", encoding="utf-8")
    assert main(line) == 2
    assert "nests too deeply" in capsys.readouterr().err
    given = {
        "verdict": "no_gap",
        "gap": {"where": []},
        "effects": [],
        "shrink": {"heldout": None, "check": None},
    }
    (tmp_path / "case_001.json").write_text(json.dumps(given), encoding="utf-8")
    assert main(line) == 0
    said = capsys.readouterr().out
    assert "false alarms where nothing hides" in said
    assert "No --hash was given" in said
    assert main([*line, "--hash", sealed[1], "--key", str(key_path(sealed[0]))]) == 0
    assert "No --hash was given" not in capsys.readouterr().out
    assert main([*line, "--hash", "0" * 64]) == 2
    result = json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
    assert sum(rate["of"] for rate in result["rates"].values()) > 0


def test_the_score_is_written_though_the_reader_of_its_tables_has_left(sealed, tmp_path, monkeypatch):
    def left(*_):
        raise BrokenPipeError

    nothing = {"verdict": "no_gap", "gap": {"where": []}, "effects": []}
    answer = nothing | {"shrink": {"heldout": None, "check": None}}
    (tmp_path / "case_001.json").write_text(json.dumps(answer), encoding="utf-8")
    monkeypatch.setattr("tui.show.put", left)
    out = tmp_path / "out.json"
    main(["challenge", "score", str(sealed[0]), "--answers", str(tmp_path), "--json", str(out)])
    assert json.loads(out.read_text(encoding="utf-8"))["rates"]


def test_one_sealed_case_is_called_one_case(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("tui.commands.challenge.seal", lambda *_: "5ea1")
    out = str(tmp_path / "hidden")
    assert main(["challenge", "seal", "--cases", "1", "--seed", "7", "--out", out]) == 0
    assert capsys.readouterr().out.startswith(f"1 case in {out}; SHA-256 of the locked answers: 5ea1")
