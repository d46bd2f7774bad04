"""What a dive was made under: the water's density, what a person types, and last time's values."""

import math

import pytest

from bridge.errors import ConfigError
from gcs_plugin.dives.conditions import (
    NAMES,
    NOTHING_SAID,
    TITLES,
    Conditions,
    density_kg_m3,
    mistakes,
    of_texts,
    texts_of,
)
from gcs_plugin.dives.folder import About, DiveFolder, last_conditions

KNOWN = Conditions(11.5, 35.0, 40.0, 2.0, -0.5, "camera", "calm")


@pytest.mark.parametrize(
    ("temperature_c", "salinity", "density"),
    [
        (5.0, 0.0, 999.96675),
        (5.0, 35.0, 1027.67547),
        (25.0, 0.0, 997.04796),
        (25.0, 35.0, 1023.34306),
    ],
)
def test_density_is_that_of_the_check_values_of_unesco_44(temperature_c, salinity, density):
    assert density_kg_m3(temperature_c, salinity) == pytest.approx(density, abs=1e-5)


def test_density_is_known_where_both_temperature_and_salinity_are():
    assert KNOWN.density_kg_m3 == density_kg_m3(11.5, 35.0)
    assert Conditions(water_temperature_c=11.5).density_kg_m3 is None
    assert Conditions(salinity=0.0).density_kg_m3 is None


def test_what_is_carried_is_ballast_and_payload_together():
    assert KNOWN.carried_kg == 1.5
    assert NOTHING_SAID.carried_kg == 0.0


@pytest.mark.parametrize(
    "values",
    [{"water_temperature_c": 50.0}, {"salinity": -1.0}, {"tether_out_m": -1.0}, {"ballast_kg": math.nan}],
)
def test_what_can_not_be_is_refused(values):
    with pytest.raises(ValueError, match="must lie from"):
        Conditions(**values)


def test_they_are_told_in_a_line():
    assert KNOWN.words == (
        "water 11.5 °C, salinity 35, tether out 40 m, ballast 2 kg, payload -0.5 kg, camera, calm"
    )
    assert Conditions(salinity=0.0).words == "salinity 0"
    assert NOTHING_SAID.words == ""


def test_a_form_asks_for_each_of_them():
    assert tuple(TITLES) == NAMES


@pytest.mark.parametrize("conditions", [KNOWN, NOTHING_SAID, Conditions(salinity=0.0, weather="swell")])
def test_what_a_form_shows_it_reads_back(conditions):
    assert of_texts(texts_of(conditions)) == conditions


def test_a_decimal_comma_is_read_and_blanks_are_nothing():
    assert of_texts({"salinity": " 34,5 ", "weather": " a  b "}) == Conditions(salinity=34.5, weather="a b")
    assert of_texts({"ballast_kg": "   "}) == NOTHING_SAID


@pytest.mark.parametrize(
    ("text", "words"),
    [("salty", "salinity: 'salty' is no number"), ("99", "salinity: must lie from 0 to 42, it is 99")],
)
def test_a_mistake_is_named(text, words):
    with pytest.raises(ConfigError, match=words):
        of_texts({"salinity": text})


def test_all_mistakes_are_told_each_by_its_field():
    texts = {"salinity": "salty", "tether_out_m": "nan", "weather": "99", "ballast_kg": "2"}
    wrong = {
        "salinity": "'salty' is no number; give one such as 12.5, or leave it empty",
        "tether_out_m": "must lie from 0 to 10000, it is nan; mend it, or leave it empty",
    }
    assert mistakes(texts) == wrong
    with pytest.raises(ConfigError) as caught:
        of_texts(texts)
    assert str(caught.value) == ". ".join(f"{name}: {sentence}" for name, sentence in wrong.items())


def dive(root, name, conditions=NOTHING_SAID):
    folder = DiveFolder(root / name)
    folder.path.mkdir(parents=True)
    folder.describe(About(notes="here", conditions=conditions))
    return folder


def test_a_dive_folder_keeps_them_beside_what_it_has(tmp_path):
    folder = dive(tmp_path, "2026-11-20T0912Z")
    folder.set_conditions(KNOWN)
    assert folder.about() == About(notes="here", conditions=KNOWN)


def test_last_times_are_those_of_the_newest_earlier_dive_that_has_any(tmp_path):
    dive(tmp_path, "2026-11-18T0900Z", Conditions(salinity=1.0))
    dive(tmp_path, "2026-11-19T0900Z", KNOWN)
    (dive(tmp_path, "2026-11-19T1000Z").path / "dive.yaml").write_text("{", encoding="utf-8")
    dive(tmp_path, "2026-11-19T1100Z")
    newest = dive(tmp_path, "2026-11-20T0900Z", Conditions(salinity=2.0))
    assert last_conditions(tmp_path, newest.path) == KNOWN
    assert last_conditions(tmp_path) == Conditions(salinity=2.0)
    assert last_conditions(tmp_path / "none") == NOTHING_SAID
