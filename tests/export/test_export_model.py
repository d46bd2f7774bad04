"""`Model`: built from what was identified and the vehicle file, and told where something lacks."""

from dataclasses import replace

import pytest

from bridge.errors import ConfigError
from bridge.vehicle.config import GRAVITY_M_S2, load_vehicle
from identify.export.model import Model, Propeller, enu, flu, model_of, pointing, volume_m3

VALUES = {
    "M_u": 111.6, "M_v": 112.41, "M_w": 134.0, "I_p": 5.2, "I_q": 15.5, "I_r": 16.0,
    "D_u": 56.2, "D_v": 70.0, "D_w": 90.0, "D_p": 4.0, "D_q": 9.0, "D_r": 11.0,
}  # fmt: skip


@pytest.fixture
def file():
    return load_vehicle("ruvifist:hovering")


def test_added_mass_is_the_total_less_the_rigid_body_and_quadratic_drag_is_none(file):
    model = model_of(VALUES, file, "hovering")
    assert model.added == pytest.approx((39.6, 40.41, 62.0, 2.0, 6.0, 5.5))
    assert model.total == pytest.approx(tuple(VALUES[n] for n in ("M_u", "M_v", "M_w", "I_p", "I_q", "I_r")))
    assert model.linear == (56.2, 70.0, 90.0, 4.0, 9.0, 11.0)
    assert model.quadratic == (0.0,) * 6
    assert model.mean_mass_kg == pytest.approx((111.6 + 112.41 + 134.0) / 3)
    assert (model.lag_s, model.net_buoyancy_n, model.density_kg_m3) == (0.05, 1.0, 998.2)
    assert (len(model.thrusters), model.intervals, model.notes) == (8, {}, ())


def test_the_centre_of_buoyancy_rights_the_vehicle_as_the_nominal_model_does(file):
    model = model_of(VALUES, file, "hovering")
    height = -model.centre_of_buoyancy_m[2]
    assert height * model.buoyancy_n == pytest.approx(0.05 * 72.0 * GRAVITY_M_S2)
    assert model.buoyancy_n == pytest.approx(72.0 * GRAVITY_M_S2 + 1.0)


def test_what_was_not_identified_comes_from_the_vehicle_files_model_or_is_none_and_is_told(file):
    shape = file.vehicle.configurations["hovering"]
    shapes = {"hovering": replace(shape, model={"D_p": 7.0})}
    file = replace(file, vehicle=replace(file.vehicle, configurations=shapes))
    few = {name: value for name, value in VALUES.items() if name not in ("D_p", "D_q", "I_q")}
    model = model_of(few, file, "hovering")
    assert model.linear[3:] == (7.0, 0.0, 11.0)
    assert model.added[4] == 0.0
    assert [note.split()[0] for note in model.notes] == ["I_q", "D_p", "D_q"]
    assert "7 is the vehicle file's own" in model.notes[1]
    assert "it is unknown" in model.notes[2]
    assert model.unknown == ("I_q", "D_q")
    assert model.undamped == (4,)


def test_a_total_mass_below_the_rigid_bodys_is_kept_and_told(file):
    model = model_of({**VALUES, "M_u": 70.0}, file, "hovering")
    assert model.added[0] == -2.0
    assert "M_u lies 2 kg below" in model.notes[0]


def test_a_vehicle_that_sinks_through_displacing_nothing_is_refused(file):
    model = replace(model_of(VALUES, file, "hovering"), net_buoyancy_n=-800.0)
    with pytest.raises(ConfigError, match="displace no water"):
        volume_m3(model, model.dry_mass_kg)
    assert volume_m3(replace(model, net_buoyancy_n=0.0), 99.82) == pytest.approx(0.1)


def test_a_propeller_loses_its_dead_zone_and_astern_its_share():
    propeller = Propeller(
        (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), -20.0, 30.0, gain=2.0, reverse_gain=0.5, dead_zone_n=1.0
    )
    assert [propeller.thrust_n(n) for n in (-50.0, -20.0, -0.5, 0.0, 1.0, 11.0, 99.0)] == [
        -19.0, -19.0, 0.0, 0.0, 0.0, 20.0, 58.0,
    ]  # fmt: skip


def test_axes_are_turned_and_a_zero_keeps_no_sign():
    assert flu((1.0, 2.0, -3.0)) == (1.0, -2.0, 3.0)
    assert enu((1.0, 2.0, -3.0)) == (2.0, 1.0, 3.0)
    assert str(flu((0.0, 0.0, 0.0))) == "(0.0, 0.0, 0.0)"
    assert pointing((0.0, 0.0, 1.0)) == pytest.approx((0.0, -1.5707963267948966, 0.0))
    assert pointing((-1.0, 1.0, 0.0)) == pytest.approx((0.0, 0.0, 2.356194490192345))


def test_a_model_needs_no_more_than_mass_inertia_and_two_diagonals():
    model = Model("bare", 10.0, (1.0, 2.0, 3.0), (1.0,) * 6, (5.0,) * 6)
    assert model.total == (11.0, 11.0, 11.0, 2.0, 3.0, 4.0)
    assert (model.thrusters, model.intervals, model.current_m_s) == ((), {}, (0.0, 0.0, 0.0))
