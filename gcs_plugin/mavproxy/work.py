# SPDX-License-Identifier: GPL-3.0-or-later
"""Identify or diagnose a dive in a process of its own (`identify.run`), and say its progress and its answer."""

import contextlib
from argparse import ArgumentError, ArgumentParser, Namespace
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from bridge.clock import Clock, utc_text
from bridge.errors import ConfigError, SeatrialError
from bridge.files import clear_way, read_small, written_ns
from bridge.plain import from_json
from bridge.reports import ERROR, Report, read
from bridge.text import typed
from bridge.vehicle.config import load_vehicle
from gcs_plugin.dives.folder import DiveFolder, conditions_of, vehicle_named
from gcs_plugin.dives.recordings import began, first_stamp_s
from gcs_plugin.job import Job
from gcs_plugin.params.identified import write_identified
from gcs_plugin.params.last_accepted import model_in_force
from gcs_plugin.params.sidecar import sidecar_path

MODULE: Final = "identify.run"
LEAVES: Final = {
    "identify": {"json": "identified.json", "param": "identified.param"},
    "diagnose": {"json": "diagnosis.json", "report": "diagnosis.html"},
}
"""Files in which each function leaves its result, in or next to the dive, unless the user names others."""
OPTIONS: Final = {
    "identify": ("vehicle", "method", "columns", "json", "param", "report"),
    "diagnose": ("vehicle", "check", "without", "accepted", "columns", "json", "report"),
}
OURS: Final = ("param", "accepted")
"""Options that are not passed on as they are."""
NONE_ACCEPTED: Final = "none"
RECEIPTS: Final = "receipts"
ENDED: Final = {0: "done", 1: "done, and there is something to read before its values are used", 4: "stopped"}


class Work:
    """Runs at most one function at a time."""

    def __init__(self, clock: Clock, say: Callable[[str], None]) -> None:
        self._clock, self._say = clock, say
        self._job: Job | None = None
        self._of, self._at = "", Namespace()
        self._tenths: dict[str, int] = {}
        self._before_ns: dict[Path, int] = {}

    def begin(self, function: str, dive: Path, options: list[str], vehicle: str) -> None:
        """Run `function` on `dive`. Raises ConfigError if one is running, or no vehicle file is known."""
        self.check_idle()
        if not dive.exists():
            raise ConfigError(f"{dive}: no such dive; check the name")
        at = _parsed(function, options)
        at.vehicle = at.vehicle or vehicle or _vehicle_of(dive)
        for option, name in LEAVES[function].items():
            if getattr(at, option) is None:
                place = dive / name if dive.is_dir() else dive.with_name(f"{dive.stem}-{name}")
                with contextlib.suppress(OSError):  # its writer will report why it can't write there
                    clear_way(place)
                setattr(at, option, str(place))
        words = ["-m", MODULE, function, str(dive), *_conditions(dive, "")]
        for option in OPTIONS[function]:
            value = getattr(at, option)
            if option not in OURS and value is not None:
                pieces = [value] if isinstance(value, str) else value
                words += [word for piece in pieces for word in (f"--{option}", piece)]
        if function == "diagnose":
            words += _conditions(Path(at.check), "check-") if at.check else []
            words += _in_force(dive, at.vehicle, at.accepted or RECEIPTS)
            words += [word for effect in conditions_of(dive).impossible for word in ("--without", effect)]
        self._of, self._at, self._tenths = function, at, {}
        self._before_ns = {place: written_ns(place) for place in (Path(at.json), self._left)}
        self._job = Job(f"{function} {dive}", words, self._clock.boot_s())
        self._say(f"{function}: {dive}, in a process of its own; `seatrial cancel` ends it")

    def check_idle(self) -> None:
        """Raise ConfigError if a function is running."""
        if self._job is not None:
            raise ConfigError(f"{self._job.title} runs; wait for it, or `seatrial cancel`")

    def tick(self) -> None:
        """Say how far it has come, and its answer once it has ended."""
        job, now_s = self._job, self._clock.boot_s()
        if job is None:
            return
        for line in job.lines(now_s):
            report = read(line)
            if report is None:
                self._say(line)
            else:
                self._hear(report)
        if job.code is None:
            return
        self._job = None
        done = job.code in (0, 1) and not job.cancelled
        if done and self._is_new(Path(self._at.json)):
            self._answer()
        ending = (
            "stopped by the user" if job.cancelled else ENDED.get(job.code, f"failed, exit code {job.code}")
        )
        self._say(f"{job.title}: {ending}, after {now_s - job.began_s:.0f} s")
        if done and self._is_new(self._left):
            upload = typed("seatrial", "params", "upload", self._left)
            self._say(upload if self._of == "identify" else f"report: {self._left}")

    def cancel(self) -> bool:
        """Stop the function; False if none is running."""
        if self._job is None:
            return False
        self._job.cancel(self._clock.boot_s())
        return True

    def status(self) -> list[str]:
        """A line about the function that is running, if any."""
        if self._job is None:
            return []
        return [f"{self._job.title}: runs for {self._clock.boot_s() - self._job.began_s:.0f} s"]

    def kill(self) -> None:
        """End the function at once, as when MAVProxy ends."""
        if self._job is not None:
            self._job.kill()
            self._job = None

    @property
    def _left(self) -> Path:
        """The file to go on with."""
        return Path(self._at.param if self._of == "identify" else self._at.report)

    def _is_new(self, place: Path) -> bool:
        """Whether a file was written since the function began: an older one is of an earlier run."""
        return written_ns(place) != self._before_ns[place]

    def _hear(self, report: Report) -> None:
        """Say an error, and a step once a tenth."""
        if report.of == ERROR:
            self._say(f"seatrial: {report.words}")
            return
        tenth = int(10 * report.share + 1e-9)
        if tenth > self._tenths.get(report.of, -1):
            self._tenths[report.of] = tenth
            self._say(f"{report.of}: {report.words} ({report.share:.0%})")

    def _answer(self) -> None:
        """Say the answer, and write the parameters of an identification."""
        try:
            answer = from_json(read_small(Path(self._at.json)))
            for line in identified_lines(answer) if self._of == "identify" else diagnosed_lines(answer):
                self._say(line)
            if self._of == "identify" and any(p["identifiable"] for p in answer["parameters"]):
                write_identified(Path(self._at.param), answer, load_vehicle(self._at.vehicle))
        except (SeatrialError, OSError, ValueError, LookupError, TypeError) as error:
            self._say(f"seatrial: {error}")


def identified_lines(answer: Mapping[str, Any]) -> Iterator[str]:
    """An identification's JSON: each parameter with its interval, then doubts and notes."""
    yield f"{answer['dive']['name']}: {answer['method']}, configuration {answer['configuration']}, {answer['outcome']}"
    for p in answer["parameters"]:
        if p["identifiable"]:
            low, high = p["given_thrust_low95"], p["given_thrust_high95"]
            given = f"; given the thrust {low:.4g} to {high:.4g}" if low > p["low95"] else ""
            yield f"{p['name']} {p['value']:.4g} {p['unit']} (95 %: {p['low95']:.4g} to {p['high95']:.4g}{given})"
    yield from dict.fromkeys(p["reason"] for p in answer["parameters"] if not p["identifiable"])
    yield from (f"warning: {doubt['sentence']}" for doubt in answer["doubts"])
    yield from (f"note: {note}" for note in answer["notes"])


def diagnosed_lines(answer: Mapping[str, Any]) -> Iterator[str]:
    """A diagnosis's JSON: the verdict, the causes with their values, the next dive, notes."""
    texts = answer["told"]
    yield texts["verdict"]
    for cause in texts["causes"]:
        yield f"  {cause['sentence']}"
        yield from (f"    {value}" for value in cause["values"])
    yield from (
        f"  {line}" for line in (*texts["character"], *texts["disturbance"], *texts["next"], *texts["notes"])
    )


class _Options(ArgumentParser):
    """Parses the options of a function; an error is a ConfigError."""

    def error(self, message: str) -> Any:
        raise ConfigError(f"{message}; in a terminal `seatrial {self.prog}` has more options")


def _parsed(function: str, options: list[str]) -> Namespace:
    parser = _Options(prog=function, add_help=False, exit_on_error=False, allow_abbrev=False)
    for option in OPTIONS[function]:
        parser.add_argument(f"--{option}", action="append" if option == "without" else "store")
    try:
        return parser.parse_args(options)
    except ArgumentError as error:
        raise ConfigError(str(error)) from None


def _in_force(dive: Path, vehicle: str, receipts: str) -> list[str]:
    """The model with accepted effects that was in force when a dive began, by a folder of receipts, or none."""
    if receipts == NONE_ACCEPTED:
        return []
    if receipts != RECEIPTS and not Path(receipts).is_dir():
        raise ConfigError(
            f"--accepted {receipts}: here a folder of receipts, or none; in a terminal `seatrial diagnose` takes files"
        )
    file = load_vehicle(vehicle)
    unix_s = began(dive) if dive.is_dir() else first_stamp_s(dive)
    if unix_s is None:
        return []
    model = model_in_force(Path(receipts), file.vehicle.name, file.configuration, utc_text(unix_s))
    if model is None or not model.sidecar.effects:
        return []
    return ["--in-force", str(sidecar_path(model.path)), "--since", model.since]


def _conditions(dive: Path, prefix: str) -> list[str]:
    conditions = conditions_of(dive)
    density = conditions.density_kg_m3
    words = [] if density is None else [f"--{prefix}density", str(density)]
    return [*words, f"--{prefix}carried", str(conditions.carried_kg)] if conditions.carried_kg else words


def _vehicle_of(dive: Path) -> str:
    """The vehicle file that a dive folder names. Raises ConfigError if it names none, or one that is not there."""
    named = vehicle_named(DiveFolder(dive).about()) if dive.is_dir() else ""
    if not named:
        raise ConfigError(
            f"{dive}: names no vehicle file; say which with `seatrial file NAME`, or give --vehicle NAME"
        )
    return named
