"""The code in the how-tos works as they say."""

import random
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bridge.vehicle.config import load_vehicle
from identify.effects.course import Course
from identify.effects.effect import Effect

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
