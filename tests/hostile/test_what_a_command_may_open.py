"""What a crew names to a command, or lies where the program keeps things, is a file of a bounded size or refused."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bridge import parameter_store
from bridge.errors import ConfigError, LogError, ParamError, SeatrialError
from bridge.file_size import MOST_SMALL_BYTES
from bridge.schema import load_yaml
from bridge.vehicle.config import load_vehicle
from gcs_plugin.holder import held
from identify.batch.jobs import IDENTIFY, job_for
from identify.batch.recordings import Recording
from identify.batch.run import Cache
from identify.challenge.seal import read_key
from tui.app import themes
from tui.app.keys import load_keymap
from tui.commands.challenge import _answer
from tui.commands.plan import check_plan, identification
from tui.exit_codes import UsageError
from tui.parameter_files import read_identification

ODD = "no file, but a pipe or a device"
LARGE = "more than the 64 MB that any of ours has"


def pipe(path: Path) -> None:
    os.mkfifo(path)


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def large(path: Path) -> None:
    """Takes no room on the disk."""
    with path.open("wb") as file:
        file.truncate(MOST_SMALL_BYTES + 1)


@pytest.fixture
def shut(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """From its call on no file may be opened: who does so fails instead of hanging."""

    def shut_() -> None:
        monkeypatch.setattr(Path, "open", lambda *_, **__: pytest.fail("opened"))

    return shut_


JSON: dict[str, tuple[Callable[[Path], Any], type[SeatrialError]]] = {
    "an identification": (read_identification, UsageError),
    "what a plan starts from": (lambda path: identification(str(path)), UsageError),
    "what a vehicle keeps": (parameter_store.load, ParamError),
    "an answer to a case": (_answer, LogError),
}


@pytest.mark.parametrize("name", JSON)
@pytest.mark.parametrize(("put", "why"), [(pipe, ODD), (device, ODD), (large, LARGE)])
def test_json_that_has_no_end_is_refused_in_one_sentence_before_it_is_opened(
    tmp_path: Path, shut: Callable[[], None], put: Callable[[Path], None], why: str, name: str
) -> None:
    read, refusal = JSON[name]
    path = tmp_path / "a.json"
    put(path)
    shut()
    with pytest.raises(refusal, match=re.escape(why)) as refused:
        read(path)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("put", [pipe, device])
@pytest.mark.parametrize(
    "read", [load_yaml, lambda path: load_vehicle(str(path)), lambda path: load_keymap(path, ())]
)
def test_yaml_that_has_no_end_is_refused_before_it_is_opened(
    tmp_path: Path, shut: Callable[[], None], put: Callable[[Path], None], read: Callable[[Path], Any]
) -> None:
    path = tmp_path / "a.yaml"
    put(path)
    shut()
    with pytest.raises(ConfigError) as refused:
        read(path)
    assert str(refused.value) == f"{path}: is {ODD}; give a YAML file"


@pytest.mark.parametrize("put", [pipe, device, large])
def test_a_plan_is_put_in_place_of_none_but_a_plan(tmp_path: Path, put: Callable[[Path], None]) -> None:
    put(tmp_path / "plan.yaml")
    with pytest.raises(UsageError, match="exists and is no plan, so it stays; name another file"):
        check_plan(str(tmp_path / "plan.yaml"))


@pytest.mark.parametrize("put", [pipe, device, large])
def test_what_lies_where_the_program_keeps_its_state_holds_nothing_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shut: Callable[[], None], put: Callable[[Path], None]
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    (tmp_path / "seatrial").mkdir()
    for name in ("tui.json", "recording.json"):
        put(tmp_path / "seatrial" / name)
    shut()
    assert themes.load_theme() == themes.ORDER[0]
    assert held(0.0) is None


@pytest.mark.parametrize("put", [pipe, device])
def test_a_batch_keeps_nothing_in_what_is_no_file(tmp_path: Path, put: Callable[[Path], None]) -> None:
    put(tmp_path / "kept")
    with pytest.raises(LogError, match=f"the results can't be kept there \\({ODD}\\)"):
        Cache(tmp_path / "kept")


@pytest.mark.parametrize(("put", "why"), [(pipe, ODD), (device, ODD), (large, LARGE)])
def test_a_column_map_without_an_end_is_not_read_for_its_hash(
    tmp_path: Path, put: Callable[[Path], None], why: str
) -> None:
    path = tmp_path / "columns.yaml"
    put(path)
    dive = Recording("dive", tmp_path, (), "ab", 1)
    with pytest.raises(OSError, match=why):
        job_for(IDENTIFY, dive, load_vehicle("ruvifist"), "likelihood", path)


@pytest.mark.parametrize("put", [pipe, device, large])
def test_a_key_of_answers_without_an_end_is_no_key(
    tmp_path: Path, shut: Callable[[], None], put: Callable[[Path], None]
) -> None:
    put(tmp_path / "key")
    shut()
    with pytest.raises(LogError, match="holds no key"):
        read_key(tmp_path / "key")
