"""A dive as an MCAP file: read by the format's own library, by ROS's decoder, and by our reader again."""

import json
import struct
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from bench.missions.mission import draw_one
from bridge import exit_codes
from identify.dive import Dive, Signal
from identify.export.mcap import FIELDS, flown, topics, write_mcap
from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.open import read_dive
from identify.ingest.ros.bags import read_bag
from tui import cli

TIME_S = np.arange(40) / 8.0 + 3.0
UNIX_S = 1_700_000_000.25
MAP = """
time: {column: time_s}
velocity: {columns: [/velocity.velocity_x_m_s, /velocity.velocity_y_m_s, /velocity.velocity_z_m_s], unit: m/s}
gyro: {columns: [/gyro.gyro_x_rad_s, /gyro.gyro_y_rad_s, /gyro.gyro_z_rad_s], unit: rad/s}
quaternion: {columns: [/attitude.q_w, /attitude.q_x, /attitude.q_y, /attitude.q_z], unit: "1"}
depth: {columns: [/depth.depth_m], unit: m}
pwm: {columns: [/commands/pwm.pwm_1_us, /commands/pwm.pwm_2_us], unit: us}
tau_cmd: {columns: [/commands/wrench.tau_x_n, /commands/wrench.tau_y_n, /commands/wrench.tau_z_n,
  /commands/wrench.tau_k_n_m, /commands/wrench.tau_m_n_m, /commands/wrench.tau_n_n_m], unit: N}
"""


def columns(count, size):
    return size * np.sin(np.outer(TIME_S, np.arange(1.0, count + 1.0)))


def made():
    velocity = columns(3, 0.7)
    velocity[5] = np.nan
    attitude = columns(4, 0.1) + np.array([1.0, 0.0, 0.0, 0.0])
    attitude /= np.linalg.norm(attitude, axis=1, keepdims=True)
    return Dive(
        "made", Path("made.tlog"), "abc", velocity=Signal(TIME_S, velocity),
        gyro=Signal(TIME_S + 0.01, columns(3, 0.2)),
        attitude=Signal(TIME_S + 0.02, attitude), depth=Signal(TIME_S[::2], columns(1, 3.0)[::2]),
        pwm=Signal(TIME_S, 1500.0 + columns(2, 100.0)), tau_cmd=Signal(TIME_S, columns(6, 30.0)),
        nu_ref=Signal(TIME_S, columns(14, 1.0)), unix_at_boot_s=UNIX_S, notes=("It was cold.",),
    )  # fmt: skip


def written(folder, dive):
    file = folder / "made.mcap"
    with file.open("wb") as opened:
        write_mcap(opened, list(topics(dive)), dive.unix_at_boot_s, {"dive": dive.name})
    return file


def test_each_signal_is_a_topic_whose_fields_end_in_their_units_at_the_vehicles_time(tmp_path):
    dive = made()
    with written(tmp_path, dive).open("rb") as opened:
        reader = make_reader(opened)
        assert reader.get_header().profile == "ros2"
        assert [said.metadata for said in reader.iter_metadata()] == [{"dive": "made"}]
        held = list(reader.iter_messages(log_time_order=False))
    assert [m.log_time for _, _, m in held] == sorted(m.log_time for _, _, m in held)
    schemas = {channel.topic: schema for schema, channel, _ in held}
    assert set(schemas) == {
        "/velocity", "/gyro", "/attitude", "/depth", "/commands/pwm", "/commands/wrench", "/controller/reference",
    }  # fmt: skip
    assert {schema.encoding for schema in schemas.values()} == {"ros2msg"}
    assert {channel.message_encoding for _, channel, _ in held} == {"cdr"}
    assert schemas["/depth"].data.decode().split() == ["float64", "time_s", "float64", "depth_m"]
    assert schemas["/attitude"].data.decode().split()[-5::2] == ["roll_deg", "pitch_deg", "heading_deg"]
    reference = schemas["/controller/reference"].data.decode().split()[1::2]
    assert reference[1] == "reference_u_m_s"
    assert reference[12:] == ["reference_r_rad_s2", "reference_heading_rad", "reference_depth_m"]
    depths = [m for _, channel, m in held if channel.topic == "/depth"]
    assert len(depths) == 20
    assert depths[1].log_time == 1_700_000_003_500_000_000
    assert struct.unpack("<4s2d", depths[1].data) == (b"\0\1\0\0", 3.25, dive.depth.value[1, 0])


def test_every_signal_that_a_dive_can_have_has_a_topic_of_its_own():
    widths = dict.fromkeys(("pwm", "rpm", "effort", "thrust_cmd"), 8)
    widths |= {name: len(own) for name, own in FIELDS.items()}
    names = [each.name for each in fields(Dive) if each.type == Signal | None]
    signals = {name: Signal(TIME_S, columns(widths[name], 0.1)) for name in names}
    dive = Dive("d", Path("d.tlog"), "", **signals)
    made_of = list(topics(dive))
    assert len({topic.name for topic in made_of}) == len(names) == len(made_of)
    assert "/commands/sticks" in {topic.name for topic in made_of}


def test_the_decoder_of_ros_reads_the_same_numbers_and_an_unknown_one_stays_unknown(tmp_path):
    dive = made()
    with AnyReader([written(tmp_path, dive)]) as reader:
        of = [c for c in reader.connections if c.topic == "/velocity"]
        said = [reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages(of)]
    seen = np.array([[m.velocity_x_m_s, m.velocity_y_m_s, m.velocity_z_m_s] for m in said])
    np.testing.assert_array_equal(seen, dive.velocity.value)
    assert np.isnan(seen[5]).all()
    assert [m.time_s for m in said] == TIME_S.tolist()


def test_imported_again_the_numbers_and_times_are_equal(tmp_path):
    dive, columns_file = made(), tmp_path / "map.yaml"
    columns_file.write_text(MAP, encoding="utf-8")
    again = read_dive(written(tmp_path, dive), columns_file)
    for name in ("velocity", "gyro", "attitude", "depth", "pwm", "tau_cmd"):
        before, after = getattr(dive, name), getattr(again, name)
        np.testing.assert_array_equal(after.value, before.value, err_msg=name)
        np.testing.assert_array_equal(after.time_s, before.time_s, err_msg=name)


def test_its_own_names_are_proposed_as_a_column_map(tmp_path):
    drawn = draw_one(100_300, seconds=30.0).dive
    file = written(tmp_path, replace(drawn, nu_fb=Signal(TIME_S, columns(6, 1.0)), velocity_is_filtered=True))
    proposal = propose(read_bag([file]).streams, file)
    taken = {choice.signal: choice.columns for choice in proposal.choices}
    assert taken["velocity"].columns[0] == "/velocity_filtered.velocity_x_m_s"
    assert proposal.columns.velocity_is_filtered
    assert taken["gyro"].unit == "rad/s"
    assert not {name for columns_of in taken.values() for name in columns_of.named if "controller" in name}
    assert all(not columns_of.scale for columns_of in taken.values())
    assert [choice.mends for choice in proposal.choices] == [()] * len(taken)


def test_times_before_zero_are_counted_from_the_whole_second_before_the_first(tmp_path):
    dive = Dive("made", Path("made.csv"), "", depth=Signal(TIME_S - 5.5, columns(1, 1.0)))
    file = tmp_path / "early.mcap"
    with file.open("wb") as opened:
        assert write_mcap(opened, list(topics(dive)), None, {}).origin_s == 3.0
    with file.open("rb") as opened:
        first = next(iter(make_reader(opened).iter_messages()))[2]
    assert first.log_time == 500_000_000
    assert struct.unpack("<4sd", first.data[:12])[1] == -2.5


def test_the_model_of_a_dive_without_a_gap_flies_as_it_was_measured():
    mission = draw_one(100_300, seconds=120.0)
    model, measured = flown(mission.dive, mission.file, mission.configuration)
    assert (model.name, measured.name) == ("/model/velocity", "/model/measured")
    assert [name.removeprefix("model_") for name in model.fields] == [
        name.removeprefix("measured_") for name in measured.fields
    ]
    np.testing.assert_array_equal(model.time_s, measured.time_s)
    surge = model.fields.index("model_u_m_s")
    off = model.value[:, surge] - measured.value[:, surge]
    assert 0 < np.sqrt(np.mean(off**2)) < 0.3 * np.std(measured.value[:, surge])


def test_the_verb_writes_a_dive_and_says_its_clock(tmp_path, capsys):
    log, columns_file, out = tmp_path / "log.csv", tmp_path / "map.yaml", tmp_path / "out.mcap"
    lines = [f"{time},{depth}" for time, depth in zip(TIME_S, columns(1, 2.0)[:, 0], strict=True)]
    log.write_text("\n".join(["t,d", *lines]), encoding="utf-8")
    columns_file.write_text("time: {column: t}\ndepth: {columns: [d], unit: m}\n", encoding="utf-8")
    words = ["export", str(log), "--columns", str(columns_file), "--to", "mcap", "--out", str(out)]
    kept = tmp_path / "said.json"
    assert cli.main([*words, "--json", str(kept)]) == exit_codes.DONE
    assert "40 messages of 1 topics; the log's time is the vehicle's clock" in " ".join(
        capsys.readouterr().out.split()
    )
    assert json.loads(kept.read_text())["messages"] == {"/depth": 40}
    with out.open("rb") as opened:
        assert make_reader(opened).get_summary().statistics.message_count == 40


def test_without_a_file_or_without_the_library_it_says_what_to_do(tmp_path, capsys, monkeypatch):
    log, columns_file = tmp_path / "log.csv", tmp_path / "map.yaml"
    log.write_text("t,d\n0,1\n1,2\n2,1\n", encoding="utf-8")
    columns_file.write_text("time: {column: t}\ndepth: {columns: [d], unit: m}\n", encoding="utf-8")
    words = ["export", str(log), "--columns", str(columns_file), "--to", "mcap"]
    assert cli.main(words) == exit_codes.BAD_INPUT
    assert "add --out FILE.mcap" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    assert cli.main([*words, "--out", str(tmp_path / "out.mcap")]) == exit_codes.BAD_INPUT
    assert "pip install 'seatrial[bags]'" in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out.mcap").exists()


def test_a_column_map_has_no_use_for_a_simulators_file(capsys):
    assert cli.main(["export", "ruvifist", "--to", "gazebo", "--columns", "map"]) == exit_codes.BAD_INPUT
    assert "--columns: has no use with --to gazebo" in capsys.readouterr().err
