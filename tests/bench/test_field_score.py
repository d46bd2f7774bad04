"""How answers to field dives are judged, and the tables that are made of it."""

from typing import Any

import numpy as np
import pytest

from bench.field import tables
from bench.field.beside import AXES, Foretold, Regressed, drifts_of
from bench.field.diagnosed import read_foretold
from bench.field.draw import NONE
from bench.field.score import Judged, delays_s, false_causes, judged, magnitudes, rate_also, rate_named
from bench.field.section import page


def cause(
    name: str, probability: float = 0.9, also: tuple[str, ...] = (), **parameters: float
) -> dict[str, Any]:
    told = {key: {"value": v, "unit": "1", "low95": None, "high95": None} for key, v in parameters.items()}
    return {"name": name, "also": list(also), "probability": probability, "parameters": told}


def dive(
    hidden: str, *named: dict[str, Any], verdict: str = "explained", size: float = 2.0, **truth: float
) -> Judged:
    told = {"name": "000", "effect": [hidden], "effect_parameters": truth, "size_over_sea": size}
    answer = {"verdict": verdict, "effects": list(named)}
    return judged({"truth": told, "answer": answer, "refusal": "", "seconds": 9.0, "drifts": {}})


def test_a_cause_is_named_that_is_first_or_accepted_where_the_verdict_explains() -> None:
    assert dive("tether", cause("tether")).by_name()
    assert dive("tether", cause("tether", 0.3), verdict="partly").by_name()
    assert dive("tether", cause("waves", 0.9), cause("tether", 0.6)).by_name()
    assert not dive("tether", cause("waves", 0.9), cause("tether", 0.4)).by_name()
    assert not dive("tether", cause("tether"), verdict="unknown").by_name()
    assert not dive("tether", cause("tether"), verdict="no_gap").by_name()


def test_an_ambiguous_verdict_names_only_what_it_accepts() -> None:
    assert dive("tether", cause("tether", 0.6), verdict="ambiguous").by_name()
    assert not dive("tether", cause("tether", 0.4), verdict="ambiguous").by_name()
    assert dive("tether", cause("waves", 0.6, ("tether",)), verdict="ambiguous").by_also()


def test_what_is_only_among_those_that_could_not_be_told_apart_is_counted_by_itself() -> None:
    cases = [
        dive("tether", cause("waves", 0.9, ("tether",))),
        dive("tether", cause("tether", 0.9, ("waves",))),
    ]
    assert (rate_named(cases).hits, rate_also(cases).hits) == (1, 1)
    assert false_causes(cases) == 0
    assert "counted by half, 75.0 % are named" in " ".join(tables.beside_goals(cases))


def test_the_hulls_own_drag_is_neither_right_nor_wrong() -> None:
    one = dive("tether", cause("quadratic_drag", 0.99), cause("tether", 0.4))
    assert one.by_name()
    assert not one.false()
    assert not dive(NONE, cause("quadratic_drag", 0.99)).false()


def test_an_accepted_cause_that_is_not_there_is_false_whatever_the_verdict() -> None:
    assert len(dive(NONE, cause("waves", 0.5), verdict="no_gap").false()) == 1
    assert not dive(NONE, cause("waves", 0.49)).false()
    assert [one.name for one in dive("tether", cause("tether"), cause("waves", 0.7)).false()] == ["waves"]


def test_of_a_thruster_the_number_has_to_match_where_it_is_told() -> None:
    def weak(number: float) -> Judged:
        return dive(
            "weak_thruster", cause("weak_thruster", thruster=number, gain=0.7), thruster=2.0, gain=0.6
        )

    assert weak(2.0).by_name()
    assert not weak(3.0).by_name()
    assert len(weak(3.0).false()) == 1


def test_sizes_are_judged_over_the_truth_and_delays_in_seconds() -> None:
    late = dive("command_delay", cause("command_delay", delay=0.13), delay=0.1)
    assert magnitudes([late]) == pytest.approx([0.3])
    assert delays_s([late]) == pytest.approx([0.03])
    weak = dive("weak_thruster", cause("weak_thruster", thruster=1.0, gain=0.72), thruster=1.0, gain=0.7)
    assert magnitudes([weak]) == pytest.approx([0.02 / 0.3])
    assert magnitudes([dive("tether", cause("waves", force_amplitude=1.0), stiffness=0.1)]) == []


def test_a_refused_dive_names_nothing_and_accuses_nobody() -> None:
    data = {"truth": {"name": "000", "effect": ["tether"], "effect_parameters": {}, "size_over_sea": 1.0}}
    one = judged({**data, "answer": None, "refusal": "too short", "seconds": 1.0, "drifts": {}})
    assert not one.by_name()
    assert not one.false()
    assert "Refused: 000 (too short)." in " ".join(tables.beside_goals([one]))


def test_goals_are_met_or_missed_by_the_figure_itself() -> None:
    good = [dive("tether", cause("tether", stiffness=0.101), stiffness=0.1) for _ in range(30)]
    assert [line.endswith("| met |") for line in tables.goals(good)[2:5]] == [True, True, True]
    bad = [dive("tether", cause("waves"), stiffness=0.1) for _ in range(3)]
    assert all("**missed**" in line for line in tables.goals(bad)[2:4])
    assert "nothing to judge" in tables.goals(bad)[4]


def test_the_page_tells_power_by_effect_and_by_size_and_what_was_said_instead() -> None:
    cases = [dive("tether", cause("tether"), size=3.0), dive("tether", cause("waves"), size=0.7), dive(NONE)]
    text = page(cases, 1)
    assert "| `tether` | 2 | 1 of 2 (9 to 91 %) | 0 | 0.70 to 3.00 | 3.00 | 0.70 | - | waves (1) |" in text
    assert "| 0.70 to 3.00 | 50.0 % (9.5 to 90.5), 1 of 2 |" in text
    assert "| `waves` | 1 | 0 |" in text


def test_drifts_are_taken_at_the_horizons_from_the_measured_velocity() -> None:
    time_s = np.tile(0.1 * np.arange(1, 51), 2)
    measured = np.zeros((100, 6))
    way = np.zeros((100, 6))
    way[:, 0] = time_s
    way[:50, 1] = np.nan
    own = Foretold(time_s, np.repeat([0, 1], 50), measured, way, way)
    after_1, after_5 = drifts_of(own, way)
    assert after_1[0] == pytest.approx(1.0)
    assert after_5[0] == pytest.approx(5.0)
    assert after_1[1] is None


def test_the_csv_of_a_check_dive_is_read_by_its_columns() -> None:
    read = read_foretold(
        "# head\ntime_s,window,measured_u,before_u,after_u\n1.0,0,0.1,0.2,0.3\n1.1,0,0.2,0.3,0.4\n"
    )
    assert read.after[:, 0].tolist() == [0.3, 0.4]
    assert np.isnan(read.after[:, 1:]).all()
    assert len(AXES) == 4
    assert Regressed.__dataclass_fields__.keys() >= {"gain", "delay_s"}
