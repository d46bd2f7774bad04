"""Real faults of a small AUV, from the files to a table: `python examples/haizhe/run.py FOLDER`.

FOLDER holds a table (`NAME.csv` or `NAME.csv.gz`) for each kind of run, with a column `run`. Half of the runs, drawn
by a hash of kind and number, are there to develop on; of these the sound ones are accepted. The other half is judged in
groups of ten. `--judge OTHER` accepts all sound runs of FOLDER and judges those of OTHER instead. For comparison, a
random forest is trained on runs of all kinds, with their labels (`pip install scikit-learn`). `--splits COUNT` judges
that half and the other, and both halves by other hashes, to show how much the split matters.

`kinds.yaml` says which kind is sound, and which answers count as right; nothing but the score knows it.
"""

import argparse
import gzip
import hashlib
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import yaml

from bridge.errors import LogError
from bridge.vehicle.config import VehicleFile, load_vehicle
from identify.dive import Dive
from identify.ingest.open import read_dive
from identify.repeats.judge import Judged
from identify.run.repeats import accept, judge

HERE = Path(__file__).parent
GROUP = 10
TREES = 300


@dataclass(frozen=True)
class Recorded:
    """A run: kind and number, as the tables have them, and its dive. `hashed_with`: more text for its hash."""

    kind: str
    number: str
    dive: Dive
    hashed_with: str = ""

    @property
    def mark(self) -> bytes:
        return hashlib.sha256(f"{self.kind}/{self.number}{self.hashed_with}".encode()).digest()

    @property
    def is_to_develop(self) -> bool:
        return self.mark[0] % 2 == 0


def lines_by_run(table: Path) -> tuple[str, dict[str, list[str]]]:
    """The head of a table, and the lines of each run."""
    opened = gzip.open if table.suffix == ".gz" else open
    runs: dict[str, list[str]] = {}
    with opened(table, "rt", encoding="utf-8") as lines:
        head = next(lines)
        for line in lines:
            runs.setdefault(line.split(",", 1)[0], []).append(line)
    return head, runs


def recorded(folder: Path, file: VehicleFile, most: int | None = None) -> Iterator[Recorded]:
    """The runs of all tables of a folder, each read as a log of its own; `most` of each kind."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "run.csv"
        for table in sorted([*folder.glob("*.csv"), *folder.glob("*.csv.gz")]):
            head, runs = lines_by_run(table)
            for number in list(runs)[:most]:
                path.write_text(head + "".join(runs[number]), encoding="utf-8")
                try:
                    dive = read_dive(path, HERE / "columns.yaml", file)
                except LogError as error:
                    sys.stderr.write(f"{table.name}, run {number}, was left out: {error}\n")
                    continue
                yield Recorded(table.name.split(".")[0], number, dive)


def groups_of(runs: Sequence[Recorded], size: int) -> Iterator[tuple[str, list[Recorded]]]:
    """Groups of runs of one kind, in the order of their hashes; a remainder is no group."""
    for kind in sorted({run.kind for run in runs}):
        of_kind = sorted((run for run in runs if run.kind == kind), key=lambda run: run.mark)
        for first in range(0, len(of_kind) - size + 1, size):
            yield kind, of_kind[first : first + size]


def words_of(judged: Judged) -> str:
    if judged.finding is None:
        return judged.verdict
    values = [
        f"{name} {value.value:.0f}" for name, value in judged.finding.parameters.items() if name == "thruster"
    ]
    return " ".join([judged.finding.name, *values])


def summary(run: Recorded) -> list[float]:
    """Features of a run for the forest: mean, spread, first and last value of each column."""
    features: list[float] = []
    for signal in run.dive.signals().values():
        for column in signal.value.T:
            known = column[np.isfinite(column)]
            features += [known.mean(), known.std(), known[0], known[-1]]
    return features


def forest_answers(known: Sequence[Recorded], groups: Sequence[Sequence[Recorded]]) -> list[str]:
    """The kind that most runs of each group have by a random forest, trained on `known` runs of all kinds."""
    from sklearn.ensemble import RandomForestClassifier

    forest = RandomForestClassifier(TREES, random_state=0)
    forest.fit([summary(run) for run in known], [run.kind for run in known])
    return [
        str(Counter(forest.predict([summary(run) for run in group])).most_common(1)[0][0]) for group in groups
    ]


def table_of(rows: Mapping[str, Sequence[tuple[bool, str]]]) -> str:
    """A table by kind: groups, right answers, and the answers given."""
    lines = [f"{'runs of':<26}{'groups':>7}{'right':>7}  answers"]
    for kind, answers in rows.items():
        said = "; ".join(
            f"{count} x {words}" for words, count in Counter(words for _, words in answers).most_common()
        )
        lines.append(f"{kind:<26}{len(answers):>7}{sum(right for right, _ in answers):>7}  {said}")
    every = [right for answers in rows.values() for right, _ in answers]
    share = f"{sum(every) / len(every):.0%}" if every else "none"
    return "\n".join([*lines, f"{'all':<26}{len(every):>7}{sum(every):>7}  {share}"])


def run(folder: Path, other: Path | None = None, group: int = GROUP, most: int | None = None) -> str:
    """The table of our answers, then that of the forest."""
    file = load_vehicle(str(HERE / "haizhe.yaml"))
    every = list(recorded(folder, file, most))
    known, judged = (every, list(recorded(other, file, most))) if other else halves(every)
    kinds = answers_by_kind()
    count, ours = our_answers(known, judged, file, group)
    head = f"{count} sound runs accepted; {len(judged)} further runs judged in groups of {group}"
    groups = list(groups_of(judged, group))
    return "\n".join([head, "", table_of(ours), "", *forest_lines(known, groups, kinds)])


def answers_by_kind() -> dict[str, str]:
    """The answer that counts as right for runs of each kind."""
    kinds: dict[str, str] = yaml.safe_load((HERE / "kinds.yaml").read_text(encoding="utf-8"))
    return kinds


def halves(runs: Sequence[Recorded]) -> tuple[list[Recorded], list[Recorded]]:
    """The runs to develop on, and the others."""
    return [run for run in runs if run.is_to_develop], [run for run in runs if not run.is_to_develop]


def our_answers(
    known: Sequence[Recorded], judged: Sequence[Recorded], file: VehicleFile, group: int
) -> tuple[int, dict[str, list[tuple[bool, str]]]]:
    """How many sound runs of `known` are accepted, and by kind our answers for groups of `judged`, with whether each is
    right."""
    kinds, configuration = answers_by_kind(), file.configuration_of(None)
    usual = accept([run.dive for run in known if kinds[run.kind] == "no_gap"], file, configuration)
    ours: dict[str, list[tuple[bool, str]]] = {}
    for kind, runs in groups_of(judged, group):
        answer = judge([run.dive for run in runs], file, configuration, usual)
        right = (answer.finding.name if answer.finding else answer.verdict) == kinds[kind]
        ours.setdefault(kind, []).append((right, words_of(answer)))
    return usual.count, ours


def splits(folder: Path, count: int, group: int = GROUP) -> str:
    """The share of right answers by each of `count` hashes, in both halves, and the wrong answers by kind."""
    file = load_vehicle(str(HERE / "haizhe.yaml"))
    every = list(recorded(folder, file))
    shares, lines = list[float](), list[str]()
    wrong, of_kind = Counter[str](), Counter[str]()
    for number in range(count):
        first, second = halves([replace(run, hashed_with=f"/{number}" if number else "") for run in every])
        for known, judged in ((first, second), (second, first)):
            _, ours = our_answers(known, judged, file, group)
            wrong.update({kind: sum(not right for right, _ in answers) for kind, answers in ours.items()})
            of_kind.update({kind: len(answers) for kind, answers in ours.items()})
            all_right = [right for answers in ours.values() for right, _ in answers]
            shares.append(float(np.mean(all_right)))
            lines.append(f"hash {number}: {sum(all_right)} of {len(all_right)} right, {shares[-1]:.0%}")
    missed = "; ".join(f"{kind} {wrong[kind]} of {of_kind[kind]}" for kind in of_kind)
    return "\n".join(
        [
            *lines,
            f"{min(shares):.0%} to {max(shares):.0%}, {np.mean(shares):.0%} on average",
            f"wrong: {missed}",
        ]
    )


def forest_lines(
    known: Sequence[Recorded], groups: Sequence[tuple[str, Sequence[Recorded]]], kinds: Mapping[str, str]
) -> list[str]:
    """The forest's table; a sentence where scikit-learn is not installed."""
    if find_spec("sklearn") is None:
        return ["no random forest beside it: scikit-learn is not installed (pip install scikit-learn)"]
    rows: dict[str, list[tuple[bool, str]]] = {}
    for (kind, _), called in zip(groups, forest_answers(known, [runs for _, runs in groups]), strict=True):
        rows.setdefault(kind, []).append((kinds[called] == kinds[kind], called))
    return [
        f"a random forest, trained on {len(known)} runs of all kinds with their labels",
        "",
        table_of(rows),
    ]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--judge", type=Path, metavar="OTHER", help="judge the runs of this folder instead")
    parser.add_argument("--group", type=int, default=GROUP, help="runs that are judged together (default 10)")
    parser.add_argument(
        "--splits", type=int, metavar="COUNT", help="judge both halves by so many hashes instead"
    )
    given = parser.parse_args()
    if given.splits:
        sys.stdout.write(splits(given.folder, given.splits, given.group) + "\n")
    else:
        sys.stdout.write(run(given.folder, given.judge, given.group) + "\n")
