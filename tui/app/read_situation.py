"""Reads the situation from the folders of dives and receipts, and from the view."""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Final

from bridge.errors import LogError, ParamError
from bridge.files import written_ns
from bridge.vehicle.mode import Mode, word_of
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.last_accepted import ACCEPTED, AcceptedValue, last_accepted, rolled_back, vehicle_in
from gcs_plugin.params.meaning import coefficient_of
from gcs_plugin.params.receipt import PastUpload
from gcs_plugin.params.unfinished import unfinished
from gcs_plugin.watch.picture import Armed, Kind
from tui.app.desk import ACCEPTABLE, DIAGNOSED, LIST, VALIDATED, Desk, ended_ns
from tui.app.diagnosis import answer_in, is_contradicted
from tui.app.drawing import SAME
from tui.app.jobs import JobState, json_in
from tui.app.next_step import AXES, Situation
from tui.app.screens.fly import flight_of
from tui.app.screens.parameters_transfer import WRITE
from tui.app.view import GONE_S, View, heard_of
from tui.dive_list import FAIR, kept_glance

DIAGNOSE: Final = "diagnose"
LONG: Final = ("identify", DIAGNOSE, "validate")
"""Verbs that take long enough for the user to wait, and to miss their work if it were lost."""
ORDER: Final = "ff"
"""The job that sets the feed-forward's mode."""
Judged = tuple[str, bool | None]
OF_MODEL: Final = (Kind.GAP, Kind.THRUSTER)
"""Alarms of a vehicle that does not answer as its model does, by which the feed-forward goes."""
NOT_JUDGED: Final[Judged] = ("", None)


def read_situation(desk: Desk, view: View) -> Situation:
    picture, dive = view.picture, _dive(desk)
    folders = desk.dives()
    values = desk.values(dive)
    system = picture.links[0].system if picture.links else None
    past = _past(desk.receipts, system, values)
    known = past.accepted
    accepted_ns = _accepted_ns(desk.receipts, known)
    if values is not None:
        uploaded_ns = _uploaded_ns(desk.receipts, values, known)
    else:
        # Receipts of an earlier vehicle say nothing of one that itself says what its set lacks.
        lacks_set = any(said.of_set and not said.past for said in picture.said)
        uploaded_ns = 0 if lacks_set else accepted_ns
    rolled = past.rolled_back if values is not None else None
    taken_back_ns = written_ns(rolled.preimage) if rolled is not None else 0
    taken_back = values is not None and taken_back_ns > written_ns(values)
    flown, go = _judged(dive) if dive is not None else ("", None)
    lacking, determined = _determined(dive) if dive is not None else ((), None)
    since = [folder for folder in folders if uploaded_ns and ended_ns(folder) > uploaded_ns]
    diagnosed = answer_in(dive / DIAGNOSED) if dive is not None else None
    accepts = values is not None and values.name == ACCEPTABLE
    sent = answer_in(values.parent / DIAGNOSED) if values is not None and accepts else None
    last = view.last_heard
    knows_mode = picture.ff_mode is not None and picture.ff_mode_age_s <= GONE_S
    return Situation(
        vehicle=bool(
            desk.vehicle or desk.name_vehicle is None or (dive is not None and desk.vehicle_of(dive))
        ),
        heard=heard_of(picture) is not None,
        contested=bool(picture.twins),
        recording=view.records,
        over=view.over,
        linked=bool(desk.links()),
        flies=picture.flies,
        flight=flight_of(desk.jobs),
        working=next((verb for verb in LONG if _works(desk.jobs.state(verb))), ""),
        then=desk.then,
        writing=any(map(desk.jobs.runs, (WRITE, ORDER))),
        dive=dive.name if dive is not None else "",
        shown=dive is None or desk.chosen() == dive,
        lacking=lacking,
        determined=determined,
        reading=desk.jobs.runs(LIST),
        identified=values is not None,
        accepts=accepts,
        changed=sent is not None and sent.changed,
        uploaded=uploaded_ns > 0,
        halfway=values is not None and past.unfinished is not None,
        taken_back=taken_back,
        after_roll_back=taken_back and dive is not None and ended_ns(dive) > taken_back_ns,
        mode=word_of(picture.ff_mode) if knows_mode and picture.ff_mode is not None else "",
        last_mode=word_of(last.ff_mode) if last is not None and last.ff_mode is not None else "",
        after_upload=dive in since,
        before_upload=dive is not None and ended_ns(dive) <= accepted_ns,
        flown=flown,
        go=go,
        verdict=diagnosed.verdict if diagnosed is not None and flown else "",
        contradicted=diagnosed is not None and diagnosed.contradicted,
        disarmed=picture.armed is Armed.DISARMED,
        lost=picture.armed in (Armed.ARMED, Armed.FAILSAFE)
        and heard_of(picture) is None
        and bool(picture.links)
        and not view.over,
        departs=view.behind_s <= GONE_S and any(alarm.kind in OF_MODEL for alarm in view.alarms),
        alarmed=view.behind_s <= GONE_S
        and picture.armed in (Armed.ARMED, Armed.FAILSAFE)
        and any(alarm.kind not in OF_MODEL for alarm in view.alarms),
        gate=_gate(since),
        departed=_departed(since[: since.index(dive)])
        if dive in since and not written_ns(dive / DIAGNOSED)
        else "",
    )


def _works(job: JobState | None) -> bool:
    """Whether its result is to be waited for. A diagnosis leaves its model after its page."""
    return job is not None and (job.runs if job.words[0] == DIAGNOSE else not job.answered)


def _dive(desk: Desk) -> Path | None:
    """The newest finished dive that can be read and whose thrusters pushed, as far as known, whichever the screens
    show."""
    return next(
        (dive for dive in reversed(desk.dives()) if desk.is_finished(dive) and not _is_idle(dive)), None
    )


def _is_idle(dive: Path) -> bool:
    """Whether a recording can't be read, or was read and none of its thrusters pushed."""
    glance = kept_glance(dive)
    if glance is not None and glance.error:
        return True
    std = glance.relative_std if glance is not None else None
    return std is not None and not any(map(math.isfinite, std.values()))


def _determined(dive: Path) -> tuple[tuple[str, ...], int | None]:
    """The masses and dampings of feed-forward axes that a dive does not determine, and how many it does."""
    glance = kept_glance(dive)
    if glance is None or glance.relative_std is None:
        return (), None
    wanted = {name: std for name, std in glance.relative_std.items() if name[-1] in AXES}
    lacking = tuple(name for name, std in wanted.items() if std > FAIR)
    return lacking, len(wanted) - len(lacking)


@dataclass(frozen=True)
class _Past:
    """What the receipts tell of a vehicle, as the functions of these names return it."""

    accepted: Mapping[str, AcceptedValue] = field(default_factory=dict)
    rolled_back: PastUpload | None = None
    unfinished: PastUpload | None = None


def _past(receipts: Path, system: int | None, values: Path | None) -> _Past:
    """What the receipts tell of the vehicle of that system, or any, and of no other vehicle than `values` are of;
    nothing where receipts can't be read. They are read anew only where a file has changed: that takes milliseconds an
    upload, for which a key would wait."""
    try:
        with os.scandir(receipts) as entries:
            state = frozenset((entry.name, entry.stat().st_mtime_ns) for entry in entries)
    except OSError:
        return _Past()
    return _read_past(receipts, system, values, written_ns(values) if values is not None else 0, state)


@lru_cache(4)
def _read_past(
    receipts: Path,
    system: int | None,
    values: Path | None,
    _changed_ns: int,
    _state: frozenset[tuple[str, int]],
) -> _Past:
    try:
        vehicle = "" if values is None else vehicle_in(values)
        accepted = last_accepted(receipts, system, vehicle)
    except (ParamError, LogError):
        vehicle, accepted = "", {}
    return _Past(accepted, rolled_back(receipts, system, vehicle), unfinished(receipts, system, vehicle))


def _uploaded_ns(receipts: Path, values: Path, known: Mapping[str, AcceptedValue]) -> int:
    """When these values, or others of theirs since they were written, were accepted, by the file's time, ns; 0 if they
    were not. Values that no vehicle ever accepted do not count: the crew left them out."""
    try:
        wanted = read_parameters(values)
    except ParamError:
        return 0

    def is_same(name: str) -> bool:
        return math.isclose(known[name].value, wanted[name], rel_tol=SAME)

    accepted = wanted.keys() & known.keys()
    if not accepted:
        return 0
    newest = max(known[name].time for name in accepted)
    newest_ns = written_ns(receipts / f"{newest}{ACCEPTED}")
    if accepted == wanted.keys():
        return newest_ns if newest_ns > written_ns(values) or all(map(is_same, wanted)) else 0
    sent = [name for name in accepted if known[name].time == newest]
    return newest_ns if newest_ns > written_ns(values) and all(map(is_same, sent)) else 0


def _accepted_ns(receipts: Path, known: Mapping[str, AcceptedValue]) -> int:
    """When values of a model were last accepted, by the file's time, ns; 0 if never."""
    times = [value.time for name, value in known.items() if coefficient_of(name) is not None]
    return written_ns(receipts / f"{max(times)}{ACCEPTED}") if times else 0


def _gate(since: Sequence[Path]) -> tuple[str, bool] | None:
    """The dive, of those since an upload, by which the feed-forward is raised to both, and its GO; see `Situation`.

    A dive that was compared in the validation of another is judged by that too, as the screen shows it.
    """
    judged = _all_judged(since)
    for dive in reversed(since):
        flown, go = judged.get(dive.name, NOT_JUDGED)
        if go is not None and (flown == Mode.SHADOW.word or (not go and flown != Mode.OFF.word)):
            return dive.name, go
    return None


def _departed(before: Sequence[Path]) -> str:
    """Of dives since an upload, before the one meant, the newest judged with the feed-forward, if it was a NO-GO and
    has no diagnosis that stands; "" otherwise."""
    judged = _all_judged(before)
    for dive in reversed(before):
        flown, go = judged.get(dive.name, NOT_JUDGED)
        if flown in (Mode.ALONE.word, Mode.BOTH.word):
            asked = written_ns(dive / DIAGNOSED) and not is_contradicted(dive / DIAGNOSED)
            return dive.name if go is False and not asked else ""
    return ""


def _all_judged(dives: Sequence[Path]) -> Mapping[str, Judged]:
    """By name what the validations of these dives say of each dive, the later validation where two do."""
    judged: dict[str, Judged] = {}
    for file in sorted((dive / VALIDATED for dive in dives), key=written_ns):
        judged |= _read_judged(file, written_ns(file))
    return judged


def _judged(dive: Path) -> Judged:
    """The mode in which a dive was flown and whether it was a GO, as its validation says; "" and None without one."""
    file = dive / VALIDATED
    return _read_judged(file, written_ns(file)).get(dive.name, NOT_JUDGED)


@lru_cache(64)
def _read_judged(file: Path, _changed_ns: int) -> Mapping[str, Judged]:
    """The dives of a validation by name."""
    try:
        runs = {str(run["dive"]): run["raising"] for run in json_in(file)}
        return {
            name: ("off", None) if raising is None else (str(raising["from"]), bool(raising["go"]))
            for name, raising in runs.items()
        }
    except (LookupError, TypeError):
        return {}
