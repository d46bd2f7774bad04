"""`seatrial batch`: identify many dives, tabulate their parameters, and show how these drift."""

import argparse
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from bridge import clock as clocks
from bridge import exit_codes
from bridge.clock import Clock
from bridge.errors import ConfigError
from bridge.links.addresses import of_link
from bridge.text import say
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import VehicleFile, load_vehicle
from identify.batch.drift import Drift, EffectDrift, chance_words, drift_of, effect_drifts
from identify.batch.jobs import DIAGNOSE, IDENTIFY, Against, Recording, Result, job_for
from identify.batch.page import MARKS, batch_report, cause_words, doubt_mark
from identify.batch.recordings import Selection, find_recordings
from identify.batch.rows import Row, Value, by_configuration, diagnosed, names_in, rows_of, to_csv, to_json
from identify.batch.run import Cache, Engine, Standing, cores, run_batch, run_here
from identify.diagnose.words.causes import words
from identify.estimators.table import METHODS
from identify.ingest.mapping.column_map import map_file
from identify.report.page import Read, with_provenance, write_report
from identify.run.diagnose import Before
from identify.run.recordings import Recording as Conditioned
from identify.words import utc, with_interval
from tui import show
from tui.accept_diagnosis import before_named
from tui.files import Files, settings
from tui.parameter_files import Leave
from tui.recordings import recording_at, ruled_out
from tui.show import STANDARD_OUTPUT, Table, Tell

PAGE, KEPT = "trends.html", "results.jsonl"
PAPER = "bench.reproduce.paper"
"""Module of the source paper's method, offered as `paper`."""


RuledOut = tuple[tuple[str, ...], tuple[str, ...]]
"""Effects that the conditions of a dive rule out, and the reasons."""

VERBS = {IDENTIFY: "identify", DIAGNOSE: "diagnose"}

PARAMETERS_WIDE = 4
"""Number of parameters that fit into 80 columns next to number and date."""


def run(arguments: argparse.Namespace) -> int:
    check(arguments)
    file = load_vehicle(arguments.vehicle)
    columns = map_file(arguments.columns) if arguments.columns else None
    with show.progress("find the recordings") as tell:
        recordings = find_recordings(arguments.dives, tell)
    cache = Cache(Path(arguments.out) / KEPT)

    method = PAPER if arguments.method == "paper" else arguments.method
    kinds = (IDENTIFY, DIAGNOSE) if arguments.diagnose else (IDENTIFY,)
    accepted = _accepted(arguments, file)
    readable, damaged = _with_conditions(recordings.recordings)
    remarks: dict[str, None] = {}
    results: dict[str, list[Result]] = {DIAGNOSE: []}
    try:
        for kind in kinds:
            jobs = []
            for recording, here, (effects, reasons) in readable:
                dived, changes = here.under_conditions(file)
                without, why = (effects, reasons) if kind == DIAGNOSE else ((), ())
                remarks |= dict.fromkeys((*changes, *why))
                jobs.append(
                    job_for(
                        kind,
                        recording,
                        dived,
                        "" if kind == DIAGNOSE else method,
                        columns,
                        Against(accepted if kind == DIAGNOSE else None, without),
                        here.carried_kg,
                    )
                )
            with show.progress(f"{VERBS[kind]} {_dives(len(jobs))}") as tell:
                clock = clocks.SystemClock()
                results[kind] = run_batch(jobs, cache, engine(arguments), teller(tell, clock))
    except KeyboardInterrupt:
        show.say(show.words(), f"what is done is kept in {cache.path}; the same command goes on from there")
        raise
    finally:
        cache.close()
    rows = rows_of([*results[IDENTIFY], *recordings.unreadable, *damaged], results[DIAGNOSE])
    return finish(arguments, file, recordings, rows, tuple(f"{remark}." for remark in remarks))


def _with_conditions(
    recordings: Sequence[Recording],
) -> tuple[list[tuple[Recording, Conditioned, RuledOut]], list[Result]]:
    """The recordings with the conditions of their dives and the effects that these rule out; failed results for those
    whose conditions can't be read."""
    readable, damaged = [], []
    for recording in recordings:
        try:
            readable.append((recording, recording_at(recording.path), ruled_out([recording.path])))
        except ConfigError as error:
            place = str(recording.path)
            damaged.append(
                Result(place, recording.name, place, recording.sha256, error=str(error), final=False)
            )
    return readable, damaged


def _accepted(arguments: argparse.Namespace, file: VehicleFile) -> dict[str, Before] | None:
    """The accepted model of each configuration of the vehicle; None without --accepted. Raises UsageError if there is
    none."""
    if not arguments.accepted:
        return None
    serves, refused = dict[str, Before](), list[exit_codes.UsageError]()
    for configuration in [file.configuration] if file.configuration else file.vehicle.configurations:
        try:
            leave = Leave(doubts=arguments.despite_doubts)
            serves[configuration] = before_named(arguments.accepted, file, configuration, leave)
        except exit_codes.UsageError as error:
            refused.append(error)
    if not serves:
        raise refused[0]
    return serves


def check(arguments: argparse.Namespace) -> None:
    """Raise UsageError for contradicting options."""
    if arguments.accepted and not arguments.diagnose:
        raise exit_codes.UsageError("--accepted is what dives are diagnosed against; give --diagnose with it")
    if arguments.method not in (*METHODS, "paper"):
        raise exit_codes.UsageError(
            f"--method {arguments.method}: no such method; give one of {', '.join(METHODS)}, paper"
        )
    if arguments.scheduler and arguments.processes:
        raise exit_codes.UsageError("--processes is for this computer; leave it out with --scheduler")
    if arguments.json == STANDARD_OUTPUT == arguments.csv:
        raise exit_codes.UsageError("--json - and --csv - would mix on standard output; give one a file")


def engine(arguments: argparse.Namespace) -> Engine:
    """Return the engine: this computer's cores, or a cluster; Dask is imported only for a cluster."""
    if arguments.scheduler:
        from identify.batch.cluster import run_on_cluster

        for sentence in of_link(f"tcp:{arguments.scheduler.partition('://')[2]}", "the scheduler"):
            say(sentence)
        return lambda jobs: run_on_cluster(jobs, arguments.scheduler)

    return lambda jobs: run_here(jobs, arguments.processes or cores())


def teller(tell: Tell, clock: Clock) -> Callable[[Standing], None]:
    """Return a callback that shows the batch's progress: dives done, dives failed, time left."""
    started_s = clock.boot_s()

    def report(standing: Standing) -> None:
        words = f"{standing.kept + standing.done} of {_dives(standing.total)}"
        if standing.kept:
            words += f", {standing.kept} known before"
        words += f", {standing.failed} failed"
        left_s = standing.time_left_s(clock.boot_s() - started_s)
        tell(standing.share, words if left_s is None else f"{words}, {duration(left_s)} left")

    return report


def _dives(number: int) -> str:
    return f"{number} dive{'' if number == 1 else 's'}"


def duration(seconds: float) -> str:
    """Format a duration: `40 s`, `12 min`, `3 h 5 min`."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def finish(
    arguments: argparse.Namespace,
    file: VehicleFile,
    recordings: Selection,
    rows: Sequence[Row],
    remarks: Sequence[str],
) -> int:
    """Show and write the results of the batch, with `remarks` on the dives' conditions, and return the exit code."""
    drifts = {name: drift_of(group) for name, group in by_configuration(rows).items()}
    effects = effects_of(rows)
    twins = [(str(twin.path), twin.why, str(twin.counted)) for twin in recordings.twins]
    with Files() as files:
        # The page comes last because drawing takes long. It is written even if the reader of the tables has left.
        try:
            files.json(
                {
                    "vehicle": {"name": file.vehicle.name, "sha256": file.sha256},
                    "method": arguments.method,
                    "dives": [to_json(row) for row in rows],
                    "conditions": list(remarks),
                    "counted_once": [
                        {"recording": path, "why": why, "same_as": counted} for path, why, counted in twins
                    ],
                    "trends": drifts_to_json(drifts),
                    "effects": effects_to_json(effects),
                },
                arguments.json,
            )
            if arguments.csv is not None:
                files.attempt(lambda: show.write_text(to_csv(rows), arguments.csv, "the CSV "))
            tell(arguments, recordings, rows, drifts, effects)
            show.say(show.words(), *remarks)
        finally:
            page = Path(arguments.out) / PAGE
            report = batch_report(file.vehicle.name, arguments.method, rows, twins, drifts, effects, remarks)
            page_report = with_provenance(report, _read(rows), file, settings(arguments))
            if files.attempt(partial(write_report, page, page_report)):
                show.say(show.words(), f"trends: {page}")
    answers = [bool(row.values) for row in rows]
    answers += [not row.causes.error for row in rows if row.causes is not None]
    if all(answers):
        return files.code(exit_codes.DONE)
    return files.code(exit_codes.PARTLY if any(answers) else exit_codes.NO)


def _read(rows: Sequence[Row]) -> list[Read]:
    """The recordings that could be read."""
    return [
        Read(row.dive, Path(row.source), row.sha256, math.nan if row.duration_s is None else row.duration_s)
        for row in rows
        if row.sha256
    ]


def effects_of(rows: Sequence[Row]) -> dict[str, tuple[EffectDrift, ...]]:
    """The drifts of effects over the dives that were diagnosed, by configuration."""
    return {
        name: effect_drifts([row.causes for row in group if row.causes is not None])
        for name, group in diagnosed(rows).items()
    }


def tell(
    arguments: argparse.Namespace,
    recordings: Selection,
    rows: Sequence[Row],
    drifts: Mapping[str, Drift],
    effects: Mapping[str, Sequence[EffectDrift]],
) -> None:
    taken = show.STANDARD_OUTPUT in (arguments.json, arguments.csv)
    console = show.results(show.STANDARD_OUTPUT if taken else None)
    show.put(console, dive_table(rows))
    for configuration, group in by_configuration(rows).items():
        drift = drifts[configuration]
        for table in parameter_tables(rows, group, drift, configuration):
            show.put(console, table)
        if drift.trends:
            show.put(console, trend_table(drift, configuration))
        show.say(console, f"{configuration}: {drift.sentence}")
    if any(row.causes is not None for row in rows):
        show.put(console, causes_table(rows))
    for configuration, of_campaign in effects.items():
        if of_campaign:
            show.put(console, effect_table(of_campaign, configuration))
        show.say(console, *(f"{configuration}: {each.sentence}" for each in of_campaign if each.is_real))
    show.say(console, *(f"counted once: {twin.path} {twin.why} {twin.counted}" for twin in recordings.twins))


def dive_table(rows: Sequence[Row]) -> Table:
    """Every dive, with the number that the other tables use for it, and the reason if it gave no result."""
    lines = [
        (str(number), utc(row.unix_s), row.configuration or "-", f"{row.dive}: {row.error or _ended(row)}")
        for number, row in enumerate(rows, start=1)
    ]
    return show.Table("dives", ("no.", "date, UTC", "configuration", "dive"), lines, numbers=("no.",))


def causes_table(rows: Sequence[Row]) -> Table:
    """Verdict and causes of every dive that was diagnosed, or why there are none."""
    lines = [
        (
            str(number),
            utc(row.unix_s),
            words(row.causes.verdict) or "-",
            row.causes.error or "; ".join(map(cause_words, row.causes.found)) or "-",
        )
        for number, row in enumerate(rows, start=1)
        if row.causes is not None
    ]
    return show.Table("causes", ("no.", "date, UTC", "verdict", "causes"), lines, numbers=("no.",))


def effect_table(drifts: Sequence[EffectDrift], configuration: str) -> Table:
    """Slope of each effect's size over the dives, with its interval and how often chance gives as much."""
    lines = [
        (
            drift.words,
            drift.parameter,
            f"{drift.named}/{drift.trend.count}",
            *with_interval(drift.slope, drift.low95, drift.high95),
            drift.per,
            chance_words(drift.chance),
        )
        for drift in drifts
    ]
    columns = ("effect", "parameter", "named in", "slope", "95 %", "per", "by chance")
    return show.Table(f"{configuration}: sizes of effects", columns, lines, numbers=("slope",))


def effects_to_json(effects: Mapping[str, Sequence[EffectDrift]]) -> dict[str, object]:
    """The drifts of effects as plain data, by configuration."""
    names = ("label", "parameter", "unit", "per", "slope", "low95", "high95", "chance", "named", "sentence")
    return {
        configuration: [
            {name: getattr(drift, name) for name in names}
            | {"significant": drift.is_real, "trend": vars(drift.trend)}
            for drift in drifts
        ]
        for configuration, drifts in effects.items()
    }


def parameter_tables(
    rows: Sequence[Row], group: Sequence[Row], drift: Drift, configuration: str
) -> list[Table]:
    """The parameters of one configuration's dives, with half the width of each 95 % interval."""
    names = names_in(group)
    tables = []
    for first in range(0, len(names), PARAMETERS_WIDE):
        shown = names[first : first + PARAMETERS_WIDE]
        columns = [f"{name} {BY_NAME[name].unit}" for name in shown]
        lines = [
            (
                f"{1 + rows.index(row)}{'' if drift.counts(row) else '*'}",
                utc(row.unix_s),
                *(_cell(row.values.get(name)) + doubt_mark(row, name, drift) for name in shown),
            )
            for row in group
        ]
        title = f"{configuration}: {', '.join(shown)}, with half of their 95 % intervals"
        title += "" if all(map(drift.counts, group)) else "; *: in no trend, undated or not converged"
        title += f"; {MARKS}" if any(name in row.doubted for row in group for name in shown) else ""
        tables.append(show.Table(title, ("no.", "date, UTC", *columns), lines, numbers=("no.", *columns)))
    return tables


def trend_table(drift: Drift, configuration: str) -> Table:
    """Change of each parameter from the first dive to the last, in per cent of its value at the first."""
    lines = []
    for name, trend in drift.trends.items():
        change, low, high = (f"{trend.percent(v):+.1f}" for v in (trend.change, trend.low95, trend.high95))
        word = ("up" if trend.change > 0 else "down") if name in drift.real else "none shown"
        lines.append((name, str(trend.count), show.number(trend.mean), change, low, high, word))
    columns = ("name", "dives", "mean", "change %", "95 % low", "95 % high", "trend")
    return show.Table(f"{configuration}: first dive to last", columns, lines, numbers=columns[1:6])


def drifts_to_json(drifts: Mapping[str, Drift]) -> dict[str, object]:
    """The trends as plain data, by configuration."""
    return {
        configuration: {
            "story": drift.story.name.lower(),
            "sentence": drift.sentence,
            "despite_doubts": drift.despite_doubts,
            "parameters": {
                name: {**vars(trend), "significant": name in drift.real}
                for name, trend in drift.trends.items()
            },
        }
        for configuration, drift in drifts.items()
    }


def _ended(row: Row) -> str:
    """Outcome of a dive: `converged, but doubts M_w`."""
    names = [name for name in names_in([row]) if name in row.doubted]
    if not names:
        return row.outcome
    return f"{row.outcome}, {'but ' if row.converged else ''}doubts {', '.join(names)}"


def _cell(value: Value | None) -> str:
    if value is None:
        return "-"
    half = (value.high95 - value.low95) / 2
    return f"{show.number(value.value)} ±{show.number(half, 2)}"
