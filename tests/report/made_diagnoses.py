"""A diagnosis made by hand, with a cause, a gap and its candidates; and its page as a reader sees it."""

import math
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser

import numpy as np

from bridge.vehicle.config import load_vehicle
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.gap.drift import Drift
from identify.diagnose.result import (
    AxisShrink,
    Character,
    Dependence,
    Diagnosis,
    Finding,
    Gain,
    Gap,
    Prediction,
    Share,
    Shrink,
    Slice,
    Tried,
    Value,
)
from identify.effects.effect import Effect
from identify.effects.library import library
from identify.report import picture
from identify.report.diagnosis import diagnosis_report
from identify.report.page import render_report

FILE = load_vehicle("ruvifist:hovering")
LIBRARY = library(FILE.vehicle.configurations["hovering"], 0.1)
NAN = math.nan


def effect(name: str, number: int = 0) -> Effect:
    return next(item for item in LIBRARY if item.name == name and item.number == number)


def finding_of(name: str, number: int = 0, **other: object) -> Finding:
    hidden = effect(name, number)
    parameters = {
        key: Value(v, unit, 0.9 * v, 1.1 * v)
        for key, (v, unit) in hidden.answer_parameters(hidden.start()).items()
    }
    made = Finding(Cause(hidden, hidden.start()), (), {}, 0.999, parameters, 60.0)
    return replace(made, **other)  # type: ignore[arg-type]


def drift(horizon_s: float, size: float) -> Drift:
    """Surge, sway and yaw fitted; off by `size` floors, a little more in surge."""
    starts_s = np.arange(100.0, 400.0)
    floor = np.array([0.01, 0.012, NAN, NAN, NAN, 0.005]) * horizon_s**0.5
    wave = np.sqrt(2) * np.sin(2 * np.pi * starts_s / 10)
    off = size * wave[:, None] * floor * np.array([1.0, 0.5, 1, 1, 1, 0.5])
    return Drift(horizon_s, starts_s, off, floor)


def gap(before: float = 3.4, after: float = 1.2) -> Gap:
    where = (
        Share("surge", "steady", 0.71),
        Share("surge", "accelerating", 0.12),
        Share("sway", "turning", 0.15),
        Share("yaw", "rest", 0.02),
    )
    slices = (
        Slice("surge", "speed", 0.0, 0.15, 0.02),
        Slice("surge", "speed", 0.15, 0.3, 0.08),
        Slice("surge", "speed", 0.3, 0.6, 0.73),
        Slice("surge", "heading", 0.0, math.pi, 0.4),
        Slice("surge", "heading", math.pi, 2 * math.pi, 0.43),
        Slice("surge", "voltage", 14.0, 16.8, 0.83),
        Slice("sway", "depth", 2.0, 5.0, 0.15),
        Slice("sway", "depth", 5.0, 7.5, 0.01),
    )
    depends = (Dependence("surge", "speed", "odd", 0.8), Dependence("yaw", "thrust_sign", None, 0.1))
    return Gap(
        before,
        tuple(drift(h, before) for h in (1.0, 5.0, 20.0)),
        tuple(drift(h, after) for h in (1.0, 5.0, 20.0)),
        {"surge": 2.4, "sway": 0.31, "yaw": 0.12},
        where,
        slices,
        depends,
    )


def shrink(before: float, after: float, value: float, low95: float = NAN, high95: float = NAN) -> Shrink:
    """In surge and yaw alike, over floors of 10 mm/s and 0.3 deg/s."""
    axes = tuple(
        AxisShrink(dof, before * floor, after * floor, floor, value, 0.61, 0.28, 0.33)
        for dof, floor in (("surge", 0.01), ("yaw", math.radians(0.3)))
    )
    return Shrink(before, after, value, low95, high95, by_axis=axes)


def diagnosis(**other: object) -> Diagnosis:
    """The same one each time, or one with other fields."""
    return replace(_plain(), **other) if other else _plain()  # type: ignore[arg-type]


@cache
def _plain() -> Diagnosis:
    tried = [Tried(item, 5.0 - 0.2 * k, False) for k, item in enumerate(LIBRARY)]
    tried[0] = replace(tried[0], gain_nats=61.2, accepted=True)
    drag = finding_of("quadratic_drag", feedforward=Gain(0.0234, 0.0051))
    return Diagnosis(
        "lap-3",
        "ruvifist",
        "hovering",
        "explained",
        gap(),
        (drag,),
        tuple(tried),
        None,
        shrink(3.4, 1.25, 0.896, 0.84, 0.94),
        shrink(3.1, 1.3, 0.857, 0.79, 0.92),
        None,
        ("The battery's voltage was not recorded.",),
        4.2,
    )


def page_of(shown: Diagnosis) -> str:
    """Its page. That of the plain diagnosis is made once, and once with its figures `sketched`."""
    return _plain_page(picture.inline) if shown is _plain() else render_report(diagnosis_report(shown))


@cache
def _plain_page(_inline: object) -> str:
    return render_report(diagnosis_report(_plain()))


def prediction(name: str) -> Prediction:
    """A minute in surge, sway and yaw; the causes take off nine tenths of what the plain model is off by."""
    n, length = 1500, 125
    time_s = 100.0 + 0.04 * np.arange(n)
    measured = 0.3 * np.sin(0.2 * time_s)[:, None] * np.array([1.0, 0.5, 0, 0, 0, 0.2])
    off = ((np.arange(n) % length) / length * 0.05)[:, None] * np.ones(6)
    floor = np.array([0.01, 0.012, NAN, NAN, NAN, 0.005])
    return Prediction(
        name,
        time_s,
        measured,
        measured + off,
        measured + 0.1 * off,
        measured + 0.5 * off,
        np.arange(n) // length,
        floor,
    )


class Text(HTMLParser):
    """The visible text, a line an element, and the attributes of every element."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.lines: list[str] = []
        self.attributes: list[tuple[str, dict[str, str | None]]] = []
        self.narrow = False
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes.append((tag, dict(attrs)))
        # What a telephone is shown says the same once more.
        if tag == "svg":
            self.narrow = dict(attrs).get("class") == "column-picture"

    def handle_endtag(self, tag: str) -> None:
        self.narrow = self.narrow and tag != "svg"

    def handle_data(self, data: str) -> None:
        if data.strip() and not self.narrow:
            self.lines.append(data.strip().replace("\N{NO-BREAK SPACE}", " "))


def read(shown: Diagnosis) -> str:
    return "\n".join(Text(page_of(shown)).lines)


def with_figure(shown: Diagnosis, name: str) -> Text:
    """The page with no figure but this one, where figures are rendered, which takes long."""
    report = diagnosis_report(shown)
    sections = (
        replace(section, figures=tuple(figure for figure in section.figures if figure.name == name))
        for section in report.sections
    )
    return Text(render_report(replace(report, sections=tuple(sections))))


UNKNOWN = Character(("yaw",), "world", "even", "intermittent", ("heading", "yaw_rate"))


def places(key: tuple[str, int]) -> list[int]:
    """Where the forms of one candidate stand in the library."""
    return [k for k, item in enumerate(LIBRARY) if (item.name, item.number) == key]
