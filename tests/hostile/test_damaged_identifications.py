"""A JSON that is almost what identify writes is refused in one sentence, by an upload and by a prior alike."""

import copy
import json
from pathlib import Path
from typing import Any

import pytest
from fuzz_files import IDENTIFIED, identification

from tui.accepted import priors_of
from tui.exit_codes import UsageError
from tui.parameter_files import Leave, targets_of_identification

ANY = Leave(any_vehicle=True, doubts=True)


def put(folder: Path, place: tuple[str | int, ...], value: Any) -> Path:
    data = copy.deepcopy(json.loads(IDENTIFIED))
    holder = data
    for key in place[:-1]:
        holder = holder[key]
    holder[place[-1]] = value
    path = folder / "i.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    return path


def test_the_one_that_all_are_made_of_is_taken(tmp_path: Path) -> None:
    (tmp_path / "i.json").write_bytes(IDENTIFIED)
    (_, (configuration, priors)), targets = identification(tmp_path)
    assert configuration == "hovering"
    assert list(priors) == ["M_u"]
    assert list(targets.values.values()) == [150.5]


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("parameters", 0), 3),
        (("parameters", 0, "name"), ["M_u"]),
        (("parameters", 0, "high95"), "1e400"),
        (("parameters", 0, "low95"), [1]),
        (("thrust_scale",), 2.0),
        (("thrust_scale", "shift"), {}),
        (("prior_dives",), 1.5),
        (("doubts", 0), "M_u"),
        (("vehicle",), []),
    ],
)
def test_one_with_something_else_in_a_place_is_refused(
    tmp_path: Path, place: tuple[str | int, ...], value: Any
) -> None:
    path = put(tmp_path, place, value)
    sentence = f"{path}: is not an identification; give the file that `seatrial identify --json` wrote"
    with pytest.raises(UsageError) as refused:
        targets_of_identification(path, "ruvifist:hovering", ANY)
    assert str(refused.value) == sentence
    with pytest.raises(UsageError) as refused:
        priors_of(path, None, ANY)
    assert str(refused.value) == sentence


@pytest.mark.parametrize("value", [float("inf"), float("nan")])
def test_one_with_what_is_no_number_of_json_is_refused(tmp_path: Path, value: float) -> None:
    path = put(tmp_path, ("parameters", 0, "low95"), value)
    with pytest.raises(UsageError, match=r"is no JSON; give the file that --json wrote"):
        targets_of_identification(path, "ruvifist:hovering", ANY)
