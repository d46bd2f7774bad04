"""The order in which `make test` begins files: long ones first, folders mixed, the same in every worker."""

import importlib.util
import itertools
from pathlib import Path
from types import SimpleNamespace

# By its path, for other folders of tests have a module of that name too.
SPEC = importlib.util.spec_from_file_location("conftest_of_all", Path(__file__).with_name("conftest.py"))
CONFTEST = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(CONFTEST)
mixed = CONFTEST.mixed


def item(file: str, name: str, slow: bool = False) -> SimpleNamespace:
    return SimpleNamespace(
        path=Path("tests") / file, name=name, get_closest_marker=lambda mark: slow and mark == "slow"
    )


def test_files_with_a_long_test_come_first_and_the_tests_of_a_file_stay_in_order() -> None:
    short = [item(f"a/test_{number}.py", name) for number in range(9) for name in "xy"]
    long = [item("b/test_long.py", "first"), item("b/test_long.py", "second", slow=True)]
    turn = mixed(short + long)
    assert turn[:2] == long
    files = [[one.name for one in tests] for _, tests in itertools.groupby(turn[2:], lambda one: one.path)]
    assert files == [["x", "y"]] * 9


def test_the_turn_is_the_same_whatever_comes_first_and_no_folder_comes_as_one() -> None:
    items = [item(f"{folder}/test_{folder}_{number}.py", "x") for folder in "ab" for number in range(20)]
    turn = mixed(items)
    assert turn == mixed(items[::-1])
    assert {one.path.parent.name for one in turn[:8]} == {"a", "b"}
