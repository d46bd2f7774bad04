"""The parameter server takes what is fit, refuses the rest in words, and never runs on half a set."""

import json
import math
import os
import threading
import zlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import ConfigError, ParamError
from bridge.onboard import store
from bridge.onboard.parameters import ParameterServer, Refusal
from bridge.schema import load_yaml
from bridge.vehicle.coefficients import COEFFICIENTS, DOFS
from bridge.vehicle.config import CONFIGS, Configuration, Thruster, Vehicle, load_vehicle
from bridge.vehicle.feedforward import feedforward
from bridge.vehicle.parameters import bounds, set_crc, to_float32, vehicle_table
from bridge.vehicle.references import Reference
from bridge.wire.framing import Encoder, Framer, decode
from bridge.wire.status_codes import Topic, coded, decoded

GROUND = Encoder(255, 190)
ALL = 68
REAL32 = dialect.MAV_PARAM_TYPE_REAL32


def vehicle(**model: float) -> Vehicle:
    shape = Configuration(
        dry_mass_kg=72.0,
        inertia_kgm2=(2.0, 9.0, 10.0),
        thrusters=(Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),),
        model=model,
    )
    return Vehicle("test", {"survey": shape, "hovering": shape})


def server(path: Path | None = None, **model: float) -> ParameterServer:
    return ParameterServer(path, vehicle_table(vehicle(**model)), system=1, component=1)


def committed(path: Path | None = None, **model: float) -> ParameterServer:
    """Parameters with the model of the vehicle file in force."""
    target = server(path, **model)
    assert target.write("FF_COMMIT", float(target.staged_crc), False) is None
    target.take_news()
    return target


def received(message: Any) -> Any:
    """The message as the other side decodes it."""
    (frame,) = Framer().feed(GROUND.encode(message))
    return decode(frame)


def ask(target: ParameterServer, message: Any, armed: bool = False) -> list[tuple[str, Any]]:
    return [(m.get_type(), m) for m in map(received, target.handle(received(message), armed))]


def set_message(name: str, value: float, kind: int = REAL32, system: int = 1, component: int = 1) -> Any:
    return dialect.MAVLink_param_set_message(system, component, name.encode(), value, kind)


def read_message(name: str = "", index: int = -1, system: int = 1, component: int = 1) -> Any:
    return dialect.MAVLink_param_request_read_message(system, component, name.encode(), index)


def fill(target: ParameterServer) -> None:
    """Stage a whole set."""
    for name in target.names[:24]:
        assert target.write(name, 24.1, False) is None


@pytest.fixture
def target():
    return server()


def test_the_table_has_every_coefficient_of_every_configuration_behind_them_effects_and_four_of_its_own():
    names = server().names
    assert len(names) == ALL == 2 * (12 + 19 + 1) + 4
    assert names[0] == "FF0_M_U"
    assert names[23] == "FF1_D_R"
    assert names[24:27] == ("FF0_X_UU", "FF0_Y_VV", "FF0_Z_WW")
    assert names[-5] == "FF1_T1_GAIN"
    assert names[-4:] == ("FF_MODE", "FF_COMMIT", "FF_ACTIVE", "FF_VERSION")
    assert all(len(name) <= 16 for name in names)


def test_a_written_coefficient_is_answered_and_read_back_by_name_and_by_its_true_index(target):
    ((kind, value),) = ask(target, set_message("FF1_M_U", 96.4))
    assert kind == "PARAM_VALUE"
    answer = (value.param_id, value.param_value, value.param_type, value.param_count, value.param_index)
    assert answer == ("FF1_M_U", to_float32(96.4), REAL32, ALL, 12)
    for question in (read_message("FF1_M_U"), read_message(index=12)):
        ((kind, again),) = ask(target, question)
        assert (kind, again.param_id, again.param_value) == ("PARAM_VALUE", "FF1_M_U", to_float32(96.4))


@pytest.mark.parametrize(
    ("name", "value", "armed", "error"),
    [
        ("FF0_M_U", math.nan, False, Refusal.OUT_OF_RANGE),
        ("FF0_M_U", math.inf, False, Refusal.OUT_OF_RANGE),
        ("FF0_D_U", 1e-40, False, Refusal.OUT_OF_RANGE),
        ("FF_MODE", 1e-40, False, Refusal.OUT_OF_RANGE),
        ("FF1_M_U", 99999.0, False, Refusal.OUT_OF_RANGE),
        ("FF1_D_R", 99999.0, False, Refusal.OUT_OF_RANGE),
        ("FF_MODE", 4.0, False, Refusal.OUT_OF_RANGE),
        ("FF_MODE", 1.5, False, Refusal.OUT_OF_RANGE),
        ("FF_MODE", 2.0, True, Refusal.DENIED),
        ("FF_MODE", 3.0, True, Refusal.DENIED),
        ("FF_COMMIT", 12345.0, False, Refusal.OUT_OF_RANGE),
        ("FF_ACTIVE", 1.0, False, Refusal.READ_ONLY),
        ("FF_VERSION", 2.0, False, Refusal.READ_ONLY),
    ],
)
def test_an_unfit_write_changes_nothing_and_is_answered_by_error_and_present_value(
    target, name, value, armed, error
):
    before = {n: target.value(n) for n in target.names}
    (first, refusal), (second, held) = ask(target, set_message(name, value), armed)
    assert (first, second) == ("PARAM_ERROR", "PARAM_VALUE")
    assert (refusal.param_id, refusal.param_index, refusal.error) == (name, -1, error)
    assert (refusal.target_system, refusal.target_component) == (255, 190)
    assert (held.param_id, held.param_value) == (name, before[name])
    assert {n: target.value(n) for n in target.names} == before


@pytest.mark.parametrize(
    "message",
    [
        set_message("FF9_M_U", 1.0),
        set_message("ff0_m_u", 1.0),
        read_message("FF9_M_U"),
        read_message(index=ALL),
        read_message(index=32767),
        read_message(""),
    ],
)
def test_an_unknown_parameter_is_answered_by_does_not_exist(message):
    ((kind, refusal),) = ask(server(), message)
    assert (kind, refusal.error) == ("PARAM_ERROR", Refusal.UNKNOWN)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("FF0_M_U", 0.3 * 72.0, 30 * 72.0),
        ("FF0_D_Q", 1e-4 * 9.0, 40.0 * 1.0 / 0.02),
        ("FF0_X_UU", 0.0, 40.0 / 0.2**2),
        ("FF0_Y_R", -40.0 / 0.1, 40.0 / 0.1),
        ("FF0_T_ASTERN", 0.3, 2.0),
    ],
)
def test_a_coefficient_is_bounded_by_what_a_vehicle_of_this_mass_and_thrust_can_have(target, name, low, high):
    least, most = np.float32(low), np.float32(high)
    for fit in (float(least), float(most), 0.0, -0.0):
        assert target.write(name, fit, False) is None
        assert target.value(name) == fit
    assert math.copysign(1.0, target.value(name)) == 1.0
    for unfit in (np.nextafter(least, np.float32(-np.inf)), np.nextafter(most, np.float32(np.inf))):
        assert target.write(name, float(unfit), False) is Refusal.OUT_OF_RANGE


def test_the_bounds_grow_with_the_number_of_thrusters_and_stay_within_those_of_the_coefficient():
    thruster = Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    ship = Configuration(dry_mass_kg=9e4, inertia_kgm2=(1e3, 1e3, 1e3), thrusters=(thruster,) * 3)
    rows = {row.name: (row.low, row.high) for row in vehicle_table(Vehicle("ship", {"ship": ship}))}
    assert rows["FF0_D_U"] == (9.0, 3 * 800.0)
    assert rows["FF0_M_U"] == (27_000.0, 1e5)
    assert rows["FF0_I_P"] == (100.0, 1e5)
    strong = replace(ship, thruster_limit_n=1e4)
    rows = {row.name: (row.low, row.high) for row in vehicle_table(Vehicle("ship", {"ship": strong}))}
    assert rows["FF0_D_U"] == (9.0, 1e5)


@pytest.mark.parametrize("path", sorted((CONFIGS / "vehicles").glob("*.yaml")), ids=lambda path: path.stem)
def test_every_vehicle_that_we_ship_and_the_truth_of_the_simulated_one_are_within_their_bounds(path):
    name = path.stem.removesuffix(".truth")
    craft = load_vehicle(name).vehicle
    rows = {(row.veh_cfg, row.coefficient): row for row in vehicle_table(craft)}
    truths = load_yaml(path) if path.stem.endswith(".truth") else {}
    for configuration, truth in truths.items():
        for coefficient, value in truth["model"].items():
            assert rows[craft.veh_cfg(configuration), coefficient].admits(value)
    assert len(rows) == sum(12 + 19 + len(shape.thrusters) for shape in craft.configurations.values())


def test_only_real32_is_taken(target):
    (_, refusal), (_, held) = ask(target, set_message("FF0_M_U", 50.0, kind=dialect.MAV_PARAM_TYPE_INT32))
    assert (refusal.error, held.param_value) == (Refusal.WRONG_TYPE, 0.0)


@pytest.mark.parametrize(("system", "component"), [(2, 1), (1, 191), (0, 0), (0, 1), (1, 0)])
def test_a_write_or_a_read_that_is_not_addressed_to_this_component_is_ignored(target, system, component):
    assert ask(target, set_message("FF0_M_U", 50.0, system=system, component=component)) == []
    assert ask(target, read_message("FF0_M_U", system=system, component=component)) == []
    assert target.value("FF0_M_U") == 0.0


@pytest.mark.parametrize(
    ("system", "component", "served"), [(1, 1, ALL), (0, 0, ALL), (1, 0, ALL), (2, 1, 0), (1, 191, 0)]
)
def test_the_list_is_served_to_those_who_ask_this_component(target, system, component, served):
    assert ask(target, dialect.MAVLink_param_request_list_message(system, component)) == []
    served_values = [received(m) for _ in range(20) for m in target.step(5)]
    assert [m.param_index for m in served_values] == list(range(served))
    assert [m.param_id for m in served_values] == list(target.names)[:served]


def test_the_list_is_paced_and_a_second_request_misses_nothing(target):
    request = dialect.MAVLink_param_request_list_message(1, 1)
    ask(target, request)
    first = target.step(5)
    ask(target, request)
    second: list[Any] = []
    while more := target.step(5):
        assert len(more) <= 5
        second += more
    assert len(first) == 5
    assert {m.param_index for m in second} == set(range(ALL))


def test_a_staged_set_is_active_only_once_its_crc_is_committed(target):
    fill(target)
    assert (target.active(0), target.active_crc, target.value("FF_ACTIVE")) == ({}, 0, 0.0)
    crc = set_crc({name: target.value(name) for name in target.names[:-4]})
    ((kind, value),) = ask(target, set_message("FF_COMMIT", float(crc)))
    assert (kind, value.param_value) == ("PARAM_VALUE", float(crc))
    assert target.value("FF_ACTIVE") == float(crc)
    assert target.active(1)["M_u"] == to_float32(24.1)
    assert len(target.active(0)) == 12
    assert target.active(7) == {}
    target.write("FF1_M_U", 30.0, False)
    assert target.active(1)["M_u"] == to_float32(24.1)


def test_the_crc_of_another_set_commits_nothing(target):
    fill(target)
    stale = float(target.staged_crc)
    target.write("FF0_M_U", 25.0, False)
    assert target.write("FF_COMMIT", stale, False) is Refusal.OUT_OF_RANGE
    assert target.active_crc == 0
    assert any("CRC" in text for text in target.take_texts())


@pytest.mark.parametrize("mode", [2.0, 3.0])
def test_nothing_is_committed_while_armed_and_the_feed_forward_acts(target, mode):
    fill(target)
    flies = target.staged_crc
    target.write("FF_COMMIT", float(flies), False)
    target.write("FF_MODE", mode, False)
    target.write("FF0_M_U", 31.0, True)
    target.take_texts()
    assert target.write("FF_COMMIT", float(target.staged_crc), True) is Refusal.DENIED
    assert target.active_crc == flies
    assert target.take_texts() == ["FF_COMMIT refused: armed, force FF off first"]
    assert target.take_texts() == []
    assert target.write("FF_MODE", 0.0, True) is None
    assert target.write("FF_COMMIT", float(target.staged_crc), True) is None
    assert target.active(0)["M_u"] == 31.0


@pytest.mark.parametrize("mode", [0.0, 1.0])
def test_a_set_is_committed_while_armed_where_the_feed_forward_does_not_act(target, mode):
    fill(target)
    target.write("FF_MODE", mode, True)
    assert target.write("FF_COMMIT", float(target.staged_crc), True) is None
    assert target.active_crc == target.staged_crc


@pytest.mark.parametrize(
    ("before", "after", "refused"),
    [
        *((0, after, after > 1) for after in range(4)),
        *((1, after, after > 1) for after in range(4)),
        *((2, after, False) for after in range(4)),
        *((3, after, after == 2) for after in range(4)),
    ],
)
def test_armed_without_good_shadow_the_mode_may_go_down_and_not_up_and_the_reason_is_told(
    before, after, refused
):
    target = committed(M_u=80.0, D_u=40.0)
    target.unproven = lambda: "shadow: 12 of 60 s flown"
    assert target.write("FF_MODE", float(before), False) is None
    assert target.write("FF_MODE", float(after), True) is (Refusal.DENIED if refused else None)
    assert target.mode == (before if refused else after)
    topics = [Topic.UNPROVEN, Topic.SHADOW] if refused else []
    assert [decoded(text).topic for text in target.take_texts()] == topics
    assert target.write("FF_MODE", float(after), False) is None
    assert target.mode == after


def test_where_no_controller_watches_shadow_nothing_is_proven():
    target = committed(M_u=80.0, D_u=40.0)
    assert target.write("FF_MODE", 3.0, True) is Refusal.DENIED
    assert target.take_texts()[1] == coded(Topic.SHADOW, "shadow: none flown, seatrial ff shadow first")


@pytest.mark.parametrize("unset", ["M_u", "D_u", "M_v", "D_v", "I_r", "D_r"])
def test_a_mass_inertia_or_damping_of_zero_is_not_set_and_turns_the_feed_forward_of_its_axis_off(
    target, unset
):
    fill(target)
    assert target.write(f"FF0_{unset.upper()}", 0.0, False) is None
    assert target.write("FF_COMMIT", float(target.staged_crc), False) is None
    assert unset not in target.active(0)
    assert target.active(1)[unset] == to_float32(24.1)
    moving = Reference((0.4, -0.2, 0.1, 0.0, 0.0, 0.15), (0.1, 0.05, 0.2, 0.0, 0.0, -0.03), 0.0, 0.6)
    term = feedforward(target.active(0), moving, (100.0,) * 6)
    (axis,) = term.off
    assert term.tau[axis] == 0.0
    assert term.faults == (coded(Topic.SET_FAULT, f"FF {DOFS[axis]} off: {unset} is missing"),)


def test_the_model_of_the_vehicle_file_is_staged_from_the_start_and_flies_once_committed():
    target = server(M_u=80.0, D_u=40.0)
    assert (target.value("FF0_M_U"), target.active(0), target.active_crc) == (80.0, {}, 0)
    assert target.write("FF_MODE", 3.0, True) is Refusal.DENIED
    refused = coded(Topic.NO_SET, "FF_MODE refused: no active set")
    assert target.take_texts() == [refused, *store.NONE_YET]
    assert target.write("FF_MODE", 3.0, False) is None
    assert tuple(target.take_texts()) == store.NONE_YET
    assert target.write("FF_COMMIT", float(target.staged_crc), False) is None
    assert target.active(0)["M_u"] == 80.0
    with pytest.raises(ConfigError, match=r"M_u is -3; give a value from 21\.6 to 2160"):
        server(M_u=-3.0)


def test_a_commit_of_0_leaves_no_set_in_force_across_a_restart_and_never_under_a_vehicle_that_flies_by_it(
    tmp_path,
):
    path = tmp_path / "parameters.json"
    target = committed(path, M_u=80.0, D_u=40.0)
    before = target.active_crc
    target.write("FF_MODE", 3.0, False)
    assert target.write("FF_COMMIT", 0.0, True) is Refusal.DENIED
    assert target.active_crc == before
    assert target.write("FF_COMMIT", 0.0, False) is None
    assert (target.active(0), target.value("FF_ACTIVE"), target.value("FF0_M_U")) == ({}, 0.0, 80.0)
    assert target.take_news() == [coded(Topic.SET_ACTIVE, "no FF set active", 0)]
    assert server(path, M_u=80.0).active_crc == 0


def test_mode_and_active_set_survive_a_restart_and_a_staged_one_does_not(tmp_path):
    path = tmp_path / "deep" / "parameters.json"
    target = server(path)
    fill(target)
    target.write("FF_COMMIT", float(target.staged_crc), False)
    target.write("FF_MODE", 3.0, False)
    target.write("FF0_M_U", 99.0, False)
    again = server(path)
    assert (again.mode, again.active_crc) == (3, target.active_crc)
    assert again.active(0) == target.active(0)
    assert again.value("FF0_M_U") == to_float32(24.1)
    assert again.take_texts() == ["F8 FF both: acts once armed"]


@pytest.mark.parametrize(
    "damage",
    ["empty", "cut", "text", "nan", "another vehicle", "a larger vehicle", "out of bounds", "mode", "list", "hulls",
     "one of two"],
)  # fmt: skip
def test_a_damaged_store_is_kept_aside_and_defaults_hold(tmp_path, damage):
    path = tmp_path / "parameters.json"
    target = server(path)
    fill(target)
    target.write("FF_COMMIT", float(target.staged_crc), False)
    whole = path.read_text()
    (data,) = json.loads(whole)["hulls"].values()

    def hull(**changes: object) -> str:
        return json.dumps({"hulls": {"": data | changes}})

    damaged = {
        "empty": "",
        "cut": whole[: len(whole) // 2],
        "text": "parameters",
        "nan": whole.replace(str(to_float32(24.1)), "NaN", 1),
        "another vehicle": hull(active={"FF0_M_U": 24.0}),
        "a larger vehicle": hull(active=data["active"] | {"FF9_M_U": 24.0}),
        "out of bounds": hull(active=data["active"] | {"FF0_M_U": -5.0}),
        "mode": hull(mode=7.0),
        "list": "[]",
        "hulls": json.dumps({"hulls": [data]}),
        "one of two": json.dumps({"hulls": {"": data, "another": data | {"mode": "both"}}}),
    }[damage]
    path.write_text(damaged)
    again = server(path)
    assert (again.mode, again.active_crc) == (0, 0)
    assert (tmp_path / "parameters.json.damaged-1").read_text() == damaged
    assert "parameters.json.damaged-1; no set is in force: upload one" in again.trouble
    texts = again.take_texts()
    assert texts[0] == "stored parameters unusable, no set in force"
    assert all(len(text) <= 50 for text in texts)
    assert not path.exists()


def test_a_set_that_cannot_be_stored_is_not_active_but_switching_off_still_works(tmp_path):
    path = tmp_path / "parameters.json"
    target = committed(path, M_u=80.0, D_u=40.0)
    target.write("FF_MODE", 3.0, False)
    before = target.active_crc
    path.unlink()
    path.mkdir()
    fill(target)
    assert target.write("FF_COMMIT", float(target.staged_crc), False) is Refusal.DENIED
    assert target.active_crc == before
    assert target.active(0)["M_u"] == 80.0
    assert target.write("FF_MODE", 0.0, True) is None
    assert target.mode == 0
    assert "parameters can't be stored: check the disk" in target.take_texts()


@pytest.mark.parametrize("fails", [False, True])
def test_a_mode_acts_while_a_disk_that_stalls_still_stores_it(tmp_path, monkeypatch, fails):
    path, goes_on = tmp_path / "parameters.json", threading.Event()
    with ThreadPoolExecutor(1) as aside:
        target = ParameterServer(path, vehicle_table(vehicle()), aside=aside)
        target.write("FF_MODE", 1.0, False)
        fsync = os.fsync

        def stalls(file: int) -> None:
            assert goes_on.wait(60.0)
            if fails:
                raise OSError(5, "Input/output error")
            fsync(file)

        aside.submit(monkeypatch.setattr, "os.fsync", stalls).result()
        assert target.write("FF_MODE", 0.0, True) is None
        assert (target.mode, server(path).mode, target.take_texts()) == (0, 1, [])
        goes_on.set()
    assert server(path).mode == fails
    assert target.take_texts() == ["parameters can't be stored: check the disk"] * fails


def test_a_mode_that_is_there_already_is_stored_once_and_where_that_failed_again(tmp_path):
    path = tmp_path / "parameters.json"
    there = server(path)
    there.write("FF_MODE", 1.0, False)
    stored = path.stat().st_ino
    there.write("FF_MODE", 1.0, False)
    assert path.stat().st_ino == stored
    path.unlink()
    path.mkdir()
    there.write("FF_MODE", 2.0, False)
    path.rmdir()
    there.write("FF_MODE", 2.0, False)
    assert server(path).mode == 2


def test_the_store_is_replaced_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "of" / "vehicle" / "parameters.json"
    first = {"here": store.Stored(1.0, {"a": 1.0}), "": store.Stored(0.0, None)}
    store.save(path, first)

    def power_cut(*_: object) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr("os.replace", power_cut)
    with pytest.raises(ParamError, match="can't be stored"):
        store.save(path, {"here": store.Stored(2.0, {"a": 2.0})})
    assert store.load(path) == first


def test_a_committed_set_is_whole_on_the_disk_then_in_place_then_its_folder_is_synced(tmp_path, monkeypatch):
    path = tmp_path / "parameters.json"
    target = server(path)
    fill(target)
    fsync, put, done = os.fsync, os.replace, []

    def synced(file: int) -> None:
        fsync(file)
        which = Path(os.readlink(f"/proc/self/fd/{file}"))
        done.append(("synced", which, store.load(which) if which.is_file() else None))

    def renamed(old: Path, new: Path) -> None:
        put(old, new)
        done.append(("renamed", Path(old), Path(new)))

    monkeypatch.setattr("os.fsync", synced)
    monkeypatch.setattr("os.replace", renamed)
    assert target.write("FF_COMMIT", float(target.staged_crc), False) is None
    new = path.with_name("parameters.json.part")
    assert done == [
        ("synced", new, store.load(path)),
        ("renamed", new, path),
        ("synced", tmp_path, None),
        ("synced", tmp_path.parent, None),  # where its folder is new, that is on the disk by this alone
    ]
    assert server(path).active_crc == target.active_crc != 0


@given(
    st.dictionaries(
        st.text("ABC_", min_size=1, max_size=16), st.floats(width=32, allow_nan=False), max_size=6
    )
)
def test_the_crc_is_24_bits_exact_in_float32_blind_to_order_and_never_zero(values):
    crc = set_crc(values)
    assert 0 < crc < 2**24
    assert to_float32(float(crc)) == crc
    assert set_crc(dict(reversed(values.items()))) == crc


def test_the_crc_tells_neighbouring_float32_values_apart_and_takes_both_zeros_for_one():
    assert set_crc({"FF0_M_U": 1.0}) != set_crc({"FF0_M_U": 1.0 + 2.0**-23})
    assert set_crc({"FF0_M_U": 96.4}) == set_crc({"FF0_M_U": to_float32(96.4)})
    assert set_crc({"FF0_D_U": -0.0}) == set_crc({"FF0_D_U": 0.0})
    written_out = b"FF0_D_U=\x00\x00\x00\x40" + b"FF0_M_U=\x00\x00\x80\x3f"
    assert set_crc({"FF0_M_U": 1.0, "FF0_D_U": 2.0}) == zlib.crc32(written_out) % 2**24 == 2_362_488


def test_each_coefficient_is_bounded_by_the_mass_and_the_thrust_of_its_vehicle():
    shape = Configuration(10.0, (1.0, 2.0, 4.0), (Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),) * 2)
    assert {c.name: bounds(c, shape) for c in COEFFICIENTS} == {
        name: pytest.approx(of_it, rel=1e-6)
        for name, of_it in {
            "M_u": (3.0, 300.0), "M_v": (3.0, 300.0), "M_w": (3.0, 300.0),
            "I_p": (0.1, 100.0), "I_q": (0.2, 200.0), "I_r": (0.4, 400.0),
            "D_u": (1e-3, 1600.0), "D_v": (1e-3, 1600.0), "D_w": (1e-3, 1600.0),
            "D_p": (1e-4, 4000.0), "D_q": (2e-4, 4000.0), "D_r": (4e-4, 4000.0),
        }.items()
    }  # fmt: skip
