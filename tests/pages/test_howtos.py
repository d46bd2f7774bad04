"""The code in the how-tos works as they say."""

import random
import re
import struct
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import ConfigError, LogError
from bridge.firmware import table
from bridge.firmware.ardusub import ARDUSUB
from bridge.links.link import memory_pair
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from bridge.wire.framing import Encoder, Framer, decode
from bridge.wire.readings import Reading, encode
from gcs_plugin.feedforward.switch import Switch
from gcs_plugin.flying.crew import Crew
from identify.effects.course import Course
from identify.effects.effect import Effect
from identify.run.vehicle_of_log import guess

HOWTO = Path(__file__).resolve().parents[2] / "docs" / "howto"


def shown(page):
    """The names that the page's block of Python defines."""
    (block,) = re.findall(r"```python\n(.*?)```", (HOWTO / page).read_text(encoding="utf-8"), re.S)
    names: dict[str, object] = {}
    exec(block, names)
    return SimpleNamespace(**names)


def course(nu):
    shape = load_vehicle("ruvifist:hovering").vehicle.configurations["hovering"]
    count, thrusters = len(nu), len(shape.thrusters)
    none = np.zeros((count, thrusters))
    far = np.full(count, np.nan)
    return Course(
        shape, 0.05 * np.arange(count), nu, 0 * nu, np.zeros((count, 3)), far, far, np.zeros((count, 2)),
        none, none + np.nan, far, 0.05, np.full(6, 100.0), np.full(6, 50.0),
    )  # fmt: skip


def test_the_effect_that_is_shown_is_absent_at_none_and_a_cube_elsewhere():
    effect = shown("add_an_effect.md").CUBIC_DRAG
    assert isinstance(effect, Effect)
    assert effect.separation.every == ("four steady speeds and a coast-down",)
    nu = np.array([[0.5, -0.2, 0.1, 0.0, 0.0, 0.3]])
    assert not effect.act(course(nu), effect.none()).wrench.any()
    wrench = effect.act(course(nu), np.array([8.0, 5.0])).wrench
    assert wrench[0] == pytest.approx([-1.0, 0.04, 0.0, 0.0, 0.0, 0.0])


@pytest.fixture
def nautilus(monkeypatch):
    """The autopilot that is shown, registered."""
    firmware = shown("add_an_autopilot.md").NAUTILUS
    monkeypatch.setattr(table, "FIRMWARES", (*table.FIRMWARES, firmware))
    return firmware


def beat(autopilot: int, component: int = 1) -> bytes:
    return Encoder(1, component).encode(dialect.MAVLink_heartbeat_message(12, autopilot, 0, 0, 4, 3))


def test_what_is_asked_for_a_recording_goes_by_the_autopilot_that_is_shown(nautilus, clock):
    sent, framer = [], Framer()
    flies = Encoder(1, 191).frame(*encode(Reading("flight", 1.0, (0.0,) * 6)))

    def hear():
        clock.advance_to(clock.now_s + 0.2)
        return framer.feed(beat(nautilus.autopilot) + beat(dialect.MAV_AUTOPILOT_INVALID, 191) + flies)

    ear = SimpleNamespace(hear=hear, send=lambda raw: sent.extend(map(decode, Framer().feed(raw))))
    crew = Crew(ear, memory_pair()[0], clock, lambda _: None)
    crew.find(1)
    for _ in range(20):
        crew.step()
    asked = {m.param1: 1e6 / m.param2 for m in sent if m.get_type() == "COMMAND_LONG" and m.command == 511}
    # One at a time: the second follows the answer to the first.
    assert asked == {dialect.MAVLINK_MSG_ID_ATTITUDE: 50.0}
    assert {m.param_id for m in sent if m.get_type() == "PARAM_REQUEST_READ"} == {"GYRO_LOWPASS_HZ"}


def stated(path: Path, autopilot: int, values: dict[str, float]) -> Path:
    """A `.tlog` in which an autopilot beats and states its parameters."""
    said = [
        dialect.MAVLink_param_value_message(name.encode(), value, 9, len(values), n)
        for n, (name, value) in enumerate(values.items())
    ]
    data = [beat(autopilot), *map(Encoder(1, 1).encode, said)]
    path.write_bytes(
        b"".join(struct.pack(">Q", 1_790_000_000_000_000 + n) + raw for n, raw in enumerate(data))
    )
    return path


def test_a_vehicle_is_guessed_by_the_autopilot_that_is_shown(nautilus, tmp_path):
    outputs = {f"OUT{n}_MOTOR": float(n) for n in range(1, 9)} | {"OUT1_MOTOR": 2.0, "OUT2_MOTOR": -1.0}
    guessed = guess(stated(tmp_path / "a.tlog", nautilus.autopilot, {"HULL": 0.0, **outputs}))
    assert (guessed.firmware, guessed.base) == (nautilus, "bluerov2_heavy")
    assert (guessed.wiring.motors, guessed.wiring.reversed) == ((2, 1, 3, 4, 5, 6, 7, 8), (1,))
    with pytest.raises(ConfigError, match="set OUTn_MOTOR"):
        guess(stated(tmp_path / "b.tlog", nautilus.autopilot, {"HULL": 0.0}))


def test_of_an_autopilot_that_is_not_supported_is_said_what_works_until_it_is_registered(
    clock, tmp_path, request
):
    px4, ours = dialect.MAV_AUTOPILOT_PX4, shown("add_an_autopilot.md").NAUTILUS

    def said(autopilot: int) -> str:
        """By `ff`, where nothing answers beside it."""
        switch = Switch(Mode.BOTH)
        for _ in range(160):
            clock.advance_to(clock.now_s + 0.05)
            switch.tick(clock.now_s)
            for frame in Framer().feed(beat(autopilot)):
                switch.on_frame(frame, clock.now_s)
        return switch.words

    page = (HOWTO / "add_an_autopilot.md").read_text(encoding="utf-8")
    assert f"`{table.not_supported(px4)}`" in page
    assert table.not_supported(px4) in said(px4)
    assert "is not supported" in said(ours.autopilot)
    with pytest.raises(
        LogError, match="its autopilot is no ArduPilot, and only ArduSub's parameters can be read"
    ):
        guess(stated(tmp_path / "a.tlog", px4, {"FRAME_CONFIG": 1.0}))
    request.getfixturevalue("nautilus")
    assert "an autopilot alone has no FF_MODE: fly by hand" in said(ours.autopilot)
    assert "use ArduSub or Nautilus for one" in table.not_supported(px4)
    with pytest.raises(
        LogError, match="no ArduPilot or Nautilus, and only ArduSub's and Nautilus's parameters"
    ):
        guess(stated(tmp_path / "a.tlog", px4, {"FRAME_CONFIG": 1.0}))


def test_a_message_that_ends_a_firmware_is_never_asked_for():
    with pytest.raises(ValueError, match=r"never ask for \[168\]"):
        replace(ARDUSUB, rates_hz={dialect.MAVLINK_MSG_ID_WIND: 1.0})


def test_the_sensor_that_is_shown_reads_what_it_writes_however_the_stream_is_cut():
    page = shown("add_a_sensor.md")
    stream = b"noise\r\n" + b"".join(
        page.encode_lines((0.1 * k, -0.02, 0.003), 0.004, 1.84) for k in range(20)
    )
    for cut in range(len(stream)):
        parser = page.LinesParser(0.05)
        results = [*parser.feed(stream[:cut], 1.0), *parser.feed(stream[cut:], 1.0)]
        assert [item.velocity[0] for item in results] == pytest.approx([0.1 * k for k in range(20)])
        assert results[0].time_s == pytest.approx(0.95)


def test_the_sensor_that_is_shown_takes_nothing_that_is_broken_and_holds_on_to_little():
    page = shown("add_a_sensor.md")
    line = page.encode_lines((0.1, 0.2, 0.3), 0.004, 1.84)
    (lost,) = page.LinesParser().feed(page.encode_lines((float("nan"),) * 3, 0.0, float("nan")), 1.0)
    assert not lost.locked
    assert page.LinesParser().feed(page.encode_lines((0.1, 0.2, 0.3), float("inf"), 1.84), 1.0) == []
    for bit in range(8 * (len(line) - 2)):
        broken = bytearray(line)
        broken[bit // 8] ^= 1 << bit % 8
        parser = page.LinesParser()
        assert parser.feed(bytes(broken), 1.0) == []
    parser, noise = page.LinesParser(), random.Random(1)
    for _ in range(200):
        assert parser.feed(bytes(noise.choices(b"$V,0123456789.", k=200)), 1.0) == []
    assert len(parser._buffer) <= 328
