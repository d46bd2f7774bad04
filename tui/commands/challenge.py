"""`seatrial challenge`: dives with hidden effects, and the score of the answers that name them."""

import argparse
import secrets
from pathlib import Path
from typing import Any

from bridge import exit_codes
from bridge.command_line import interrupted_in_order
from bridge.errors import LogError
from bridge.files import check_small
from identify.challenge.answer import Answer, read_answer
from identify.challenge.case import left_out
from identify.challenge.score import Rate, Score, score
from identify.challenge.seal import hash_path, key_path, seal, unsealed
from tui import show


def run(arguments: argparse.Namespace) -> int:
    return _seal(arguments) if arguments.action == "seal" else _score(arguments)


def _seal(arguments: argparse.Namespace) -> int:
    console = show.results(arguments.json)
    without = left_out(arguments.without) if arguments.without else ()
    with interrupted_in_order(), show.progress("sealing") as tell:
        digest = seal(
            Path(arguments.out), arguments.cases, arguments.seed, secrets.token_hex(32), tell, without
        )
    key, published = (str(path(Path(arguments.out))) for path in (key_path, hash_path))
    sealed = {
        "cases": arguments.cases,
        "out": arguments.out,
        "sha256": digest,
        "key": key,
        "without": without,
    }
    show.write_json(sealed, arguments.json)
    cases = f"{arguments.cases} case{'' if arguments.cases == 1 else 's'}"
    show.say(console, f"{cases} in {arguments.out}; SHA-256 of the locked answers: {digest}")
    show.say(
        console,
        f"Publish that hash, which is also in {published}, before anything is diagnosed; keep {key}, which opens the "
        "answers, from who is judged.",
    )
    if without:
        show.say(console, f"leave out of the library: {', '.join(without)}")
    return exit_codes.DONE


def _answer(path: Path) -> Answer | None:
    try:
        if path.exists():
            check_small(path)
        return read_answer(path)
    except OSError as error:
        raise LogError(
            f"{path}: can't be read ({error.strerror}); give the JSON that diagnose wrote"
        ) from None
    except RecursionError:
        raise LogError(
            f"{path}: is no answer of diagnose (it nests too deeply); give the JSON that it wrote"
        ) from None


def _score(arguments: argparse.Namespace) -> int:
    folder = Path(arguments.answers)
    if not folder.is_dir():
        raise LogError(f"{folder}: is no folder; give the one that holds case_001.json and so on")
    key = Path(arguments.key) if arguments.key else None
    truths = unsealed(Path(arguments.folder), arguments.hash, key)
    given = {truth["name"]: _answer(folder / f"{truth['name']}.json") for truth in truths}
    answers = {name: answer for name, answer in given.items() if answer is not None}
    if not answers:
        raise LogError(
            f"{folder}: holds no answer to any case of {arguments.folder}; name them case_001.json"
        )
    result = score(truths, answers)
    show.write_json(_plain(result), arguments.json)
    _show(result, arguments.json)
    if not arguments.hash:
        show.say(
            show.results(arguments.json),
            "No --hash was given: the answers are held against the hash that lies beside them alone, which whoever "
            "changes them can change, too.",
        )
    return exit_codes.DONE if not result.unanswered else exit_codes.PARTLY


def _show(result: Score, json_target: str | None) -> None:
    console = show.results(json_target)
    rows = [
        (f"{100 * rate.share:.1f}" if rate.of else "-", *_bounds(rate), str(rate.of), measure.value)
        for measure, rate in result.rates.items()
    ]
    columns = ("%", "low 95", "high 95", "cases", "what")
    show.put(console, show.Table("rates", columns, rows, columns[:4]))
    effects = [
        (
            effect.name,
            f"{effect.rate.hits}/{effect.rate.of}",
            _size(effect.smallest_found),
            _size(effect.largest_missed),
        )
        for effect in result.effects
    ]
    heads = ("effect", "named", "smallest named", "largest missed")
    show.put(console, show.Table("by effect, sizes over the noise floor", heads, effects, heads[1:]))
    values = [(show.number(value, 3), measure.value) for measure, value in result.numbers.items()]
    show.put(console, show.Table("numbers", ("value", "what"), values, ("value",)))
    if result.unanswered:
        show.say(console, f"no answer, so nothing named there: {', '.join(result.unanswered)}")


def _size(floors: float) -> str:
    """A size in multiples of the noise floor; below 0.01, a refit absorbs the effect completely."""
    return "<0.01" if floors < 0.01 else show.number(floors, 2)


def _bounds(rate: Rate) -> tuple[str, str]:
    low, high = rate.bounds()
    return f"{100 * low:.1f}", f"{100 * high:.1f}"


def _plain(result: Score) -> dict[str, Any]:
    return {
        "rates": {
            measure.value: {"hits": rate.hits, "of": rate.of, "share": rate.share, "low95": rate.bounds()[0],
                            "high95": rate.bounds()[1]}
            for measure, rate in result.rates.items()
        },
        "numbers": {measure.value: value for measure, value in result.numbers.items()},
        "effects": {
            effect.name: {"hits": effect.rate.hits, "of": effect.rate.of, "smallest_found": effect.smallest_found,
                       "largest_missed": effect.largest_missed}
            for effect in result.effects
        },
        "unanswered": result.unanswered,
    }  # fmt: skip
