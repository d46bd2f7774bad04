"""In CI nothing may be skipped, but for data beside the checkout, and for a firmware, where there are none."""

import gc
import os
import shutil
import zlib
from collections.abc import Iterator
from copy import deepcopy
from functools import lru_cache
from pathlib import Path

import figures
import hypothesis
import pytest

from bridge import plain
from bridge.clock import SimulatedClock

FIRMWARE = "SEATRIAL_ARDUSUB"
SHARED = Path(__file__).resolve().parents[1].parent / "shared"

# A machine with other work to do is slow, and no promise is broken by that.
hypothesis.settings.register_profile("whatever_it_takes", deadline=None)
hypothesis.settings.load_profile("whatever_it_takes")


@pytest.hookimpl
def pytest_configure(config: pytest.Config) -> None:
    """A file of YAML is parsed once: each verb, each app and many a test file read the same few vehicle files, at 10 ms
    each."""
    parsed, patch = lru_cache(maxsize=64)(plain.from_yaml), pytest.MonkeyPatch()
    patch.setattr(plain, "from_yaml", lambda text: deepcopy(parsed(text)))
    config.add_cleanup(patch.undo)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """What is collected stays until the end, and an app of a test is gone soon: to look through them for garbage, again
    and again, takes long."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(20_000, 20, 100)
        gc.enable()


def mixed(items: list[pytest.Item]) -> list[pytest.Item]:
    """Files that hold a long test first, so that none is begun last; the others as dice throw them, the same each time.

    Files of one folder wait, or compute, all alike: side by side they would leave cores idle, or too few.
    """
    long = {item.path for item in items if item.get_closest_marker("slow")}
    return sorted(items, key=lambda item: (item.path not in long, zlib.crc32(os.fsencode(item.path.name))))


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if hasattr(config, "workerinput"):
        items[:] = mixed(items)


@pytest.hookimpl
def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.failed:
        figures.take_away(report.nodeid.partition("[")[0])


@pytest.fixture(autouse=True)
def _lines_as_wide_as_they_like(monkeypatch: pytest.MonkeyPatch) -> None:
    """Output must not depend on the terminal that the tests are started from."""
    monkeypatch.delenv("COLUMNS", raising=False)


@pytest.fixture(autouse=True)
def _no_recording_runs(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """No test meets a recording of whoever runs the tests, nor what another test left in the state folder."""
    state = tmp_path_factory.getbasetemp() / "state"
    shutil.rmtree(state, ignore_errors=True)
    monkeypatch.setenv("XDG_STATE_HOME", str(state))


@pytest.fixture
def clock() -> SimulatedClock:
    """Time that passes as a test says."""
    return SimulatedClock()


@pytest.fixture
def switched_off() -> Iterator[None]:
    """Diving vehicles close their files at the end."""
    from diving_vehicle import switch_all_off

    yield
    switch_all_off()


@pytest.fixture
def sketched(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages and files come without their figures rendered; each kind of page has a test that renders them."""
    if "rendered" not in request.fixturenames:
        import sketches

        monkeypatch.setattr("identify.report.picture.inline", sketches.inline)
        monkeypatch.setattr("identify.report.picture.write_files", sketches.write_files)


@pytest.fixture
def rendered() -> None:
    """In a file whose pages are sketched: this test reads what stands in a figure, or renders all of a page."""


def unexcused(skips: list[str], shared_is_there: bool) -> list[str]:
    """The reasons, of those given, that CI does not take. No project can ship ArduSub, so CI runs without it."""
    absent = ("" if shared_is_there else "shared", "" if os.environ.get(FIRMWARE) else FIRMWARE)
    return [reason for reason in skips if not any(word and word in reason for word in absent)]


def _skips(config: pytest.Config) -> list[str]:
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    reports = reporter.stats.get("skipped", []) if reporter else []
    return unexcused([str(r.longrepr[-1] if r.longrepr else "") for r in reports], SHARED.is_dir())


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    on_a_worker = hasattr(session.config, "workerinput")
    if (
        os.environ.get("CI") == "true"
        and not on_a_worker
        and session.exitstatus == 0
        and _skips(session.config)
    ):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    if os.environ.get("CI") == "true":
        for reason in _skips(config):
            terminalreporter.write_line(f"skipped, and CI takes no skip: {reason}", red=True)
