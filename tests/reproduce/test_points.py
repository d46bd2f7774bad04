"""The paper's numbers as they are printed, and each point's arithmetic as a reader finds it."""

import re
from pathlib import Path

import pytest

from bench.reproduce import published
from bench.reproduce.points import checks, points
from bench.reproduce.published import TABLE_3, TABLE_4, TABLE_5, Published
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle

PAPER = Path(__file__).resolve().parents[2].parent / "shared" / "paper.txt"
BY_TITLE = {point.title: point for point in points(72.0)}


def as_printed(number):
    """The ways in which the paper may write a number: 10 500, 62.30 %, 0.0080."""
    value = number.value
    forms = {
        f"{value:g}",
        f"{value:.1f}",
        f"{value:.2f}",
        f"{value:.4f}",
        f"{100 * value:.2f}",
        f"{100 * value:g}",
    }
    if value >= 1000:
        forms |= {f"{int(value):,}".replace(",", " "), f"{int(value)}"}
    return forms


@pytest.mark.parametrize(
    "number",
    [
        *(pytest.param(n, id=name) for name, n in vars(published).items() if isinstance(n, Published)),
        *(pytest.param(n, id=f"Table 3 {name}") for name, n in TABLE_3.items()),
        *(pytest.param(n, id=f"Table 4 {name}") for name, n in TABLE_4.items()),
    ],
)
def test_every_number_stands_in_the_paper(number):
    if not PAPER.exists():
        pytest.skip("needs ../shared/paper.txt beside the checkout")
    if number is published.RAMP:
        number = Published(22.0, "s", "the ramp's end; it begins at 7 s")
    text = PAPER.read_text(encoding="utf-8")
    assert any(re.search(rf"(?<![\d.]){re.escape(form)}(?!\d)", text) for form in as_printed(number))


def test_table_5_is_that_of_the_paper():
    if not PAPER.exists():
        pytest.skip("needs ../shared/paper.txt beside the checkout")
    text = PAPER.read_text(encoding="utf-8")
    for phase in ("Acceleration", "Steady state", "Deceleration", "Overall"):
        assert f"{phase}\t{TABLE_5['surge', phase]:.4f} m/s\t{TABLE_5['sway', phase]:.4f} m/s" in text


@pytest.mark.parametrize(("configuration", "table"), [("survey", TABLE_3), ("hovering", TABLE_4)])
def test_the_simulated_vehicle_is_what_the_tables_say_with_x_as_added_mass(configuration, table):
    file = load_vehicle("ruvifist")
    truth = load_truth(file, configuration).model
    dry = file.vehicle.configurations[configuration].dry_mass_kg
    true = {**truth, "X_udot": truth["M_u"] - dry, "Y_vdot": truth["M_v"] - dry}
    assert {name: true[name] for name in table} == pytest.approx({n: p.value for n, p in table.items()})


@pytest.mark.parametrize(
    ("title", "figure"),
    [
        ("X, added or total mass", "0.068 m/s"),
        ("Yaw inertia", "I_r = 21.8 kg m², or 15.3 kg m²"),
        ("2.40 N in surge", "11 % of it"),
        ("2.40 N in surge", "57 mm/s off"),
        ("1.7 N m in yaw", "74 % of the 2.3 N m of 90°"),
        ("Distance of the survey", "at most 327 m fit"),
        ("Distance of the survey", "1/0.5 + 1/0.4 + 1/0.3 + 1/0.2"),
        ("Power and thrust", "103 % more"),
        ("What the PID adds to the feed-forward", "would have to add 1.79 N"),
        ("The network's part", "38.3 million weights"),
    ],
)
def test_a_point_says_its_arithmetic(title, figure):
    assert figure in BY_TITLE[title].follows


def test_a_heavier_vehicle_would_be_further_off_without_its_dry_mass():
    light, heavy = points(30.0)[0].numbers, points(72.0)[0].numbers
    assert light["error_without_dry_mass_m_s"] < heavy["error_without_dry_mass_m_s"]
    assert light["left_out_kg"] == heavy["left_out_kg"] < 10.0


@pytest.mark.parametrize("point", BY_TITLE.values(), ids=list(BY_TITLE))
def test_every_point_says_what_is_printed_what_follows_and_what_would_fit(point):
    for sentence in (point.says, point.follows, point.fits_if):
        assert sentence.endswith((".", "°."))
        assert not re.search(r"\d\.\d{5}|nan|inf\b", sentence)
    assert point.says[0].isupper()
    assert point.follows[0].isupper() or point.follows.startswith("I_r")


def test_what_fits_fits_to_the_printed_digits():
    same = {check.what: (check.stated, check.computed) for check in checks()}
    for what in (
        "Rise of X_u",
        "Rise of D_u",
        "Eq. 17: 1.33 / cos 34°",
        "Fig. 15: target less settled speed",
    ):
        assert same[what][0] == same[what][1]
