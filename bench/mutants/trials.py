"""A mutant on a copy of the tree: the first of its nearest tests that fails, or none."""

import contextlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from bench.mutants.changes import Mutant
from bench.mutants.nearest_tests import import_steps, nearest_tests
from bench.remembered import ONE_THREAD, Data, Remembered
from bench.stamp import PACKAGES, stamp

PRODUCT = (*PACKAGES, "configs/*/*.yaml")
ENOUGH_S = 60.0
"""No further test is begun for a mutant once those it had take so long without it, in seconds of a processor: what else
runs on the computer decides no verdict."""

PATIENCE, START_S = 5.0, 60.0
"""A test that takes so many times as long as without the mutant, and this for compiling, hangs."""

LONGEST_S = 1200.0
LEFT_OUT = (".venv", ".git", ".*_cache", ".hypothesis", "runs", "__pycache__")


@dataclass(frozen=True)
class Verdict:
    """The test file that noticed a mutant, None if none did; `tests` is the number that ran."""

    mutant: Mutant
    by: str | None
    tests: int


@contextlib.contextmanager
def checkout(root: Path) -> Iterator["Checkout"]:
    """A copy of the tree in a temporary folder, with data beside it, if there are any."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as place:
        copy = Path(place) / "checkout"
        shutil.copytree(root, copy, ignore=shutil.ignore_patterns(*LEFT_OUT))
        if (root.parent / "shared").is_dir():
            (Path(place) / "shared").symlink_to(root.parent / "shared")
        yield Checkout(copy)


class Checkout:
    """A copy of the tree, in which tests run with and without mutants. Its compiled kernels lie beside it."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._kernels, self._mutated = root.parent / "kernels", root.parent / "kernels-mutated"
        self._kernels.mkdir()

    def compile(self) -> None:
        """Compile the kernels that tests run through, so that they take no test's time."""
        subprocess.run(
            [sys.executable, "tests/kernels.py"],
            cwd=self._root,
            env=self._environment(self._kernels, bytecode=True),
            check=True,
        )

    def judged(self, mutant: Mutant, kept: Remembered) -> Verdict:
        """Whether a test fails of a mutant, from results in `kept` if neither its file nor that test has changed."""
        key = f"{mutant} at byte {mutant.begin} in {stamp(mutant.file)}"
        if key in kept:
            known = kept.get(key, dict)
            if known["code"] == stamp(known["by"] or "tests"):
                return Verdict(mutant, known["by"], known["tests"])
        verdict = self._ran(mutant, nearest_tests(self._root, mutant.file), kept)
        code = stamp(verdict.by or "tests")
        kept.put(key, {"by": verdict.by, "tests": verdict.tests, "code": code})
        return verdict

    def _ran(self, mutant: Mutant, tests: list[str], kept: Remembered) -> Verdict:
        spent_s, count = 0.0, 0
        for test in tests:
            alone = kept.get(f"{test} {stamp(test)} {stamp(*PRODUCT)}", partial(self._alone, test))
            if not alone["passes"]:
                continue
            count, spent_s = count + 1, spent_s + alone["processor"]
            with self._changed(mutant):
                code, *_ = self._run(test, START_S + PATIENCE * alone["seconds"], self._mutated)
            if code:
                return Verdict(mutant, test, count)
            if spent_s > ENOUGH_S:
                break
        return Verdict(mutant, None, count)

    def _alone(self, test: str) -> Data:
        code, seconds, of_processor = self._run(test, LONGEST_S, self._kernels, bytecode=True)
        return {"passes": code == 0, "seconds": seconds, "processor": of_processor}

    @contextlib.contextmanager
    def _changed(self, mutant: Mutant) -> Iterator[None]:
        """The mutant stands in the tree, and no kernel is left that was compiled with the code it changes."""
        file = self._root / mutant.file
        source, stat = file.read_bytes(), file.stat()
        shutil.rmtree(self._mutated, ignore_errors=True)
        shutil.copytree(self._kernels, self._mutated, copy_function=os.link)
        stale = {(Path(path).parent.name, Path(path).stem) for path in import_steps(self._root, mutant.file)}
        for kernel in self._mutated.rglob("*.nb?"):
            if (kernel.parent.name.rpartition("_")[0], kernel.name.partition(".")[0]) in stale:
                kernel.unlink()
        try:
            file.write_bytes(mutant.applied(source))
            # Bytecode is taken for that of a source of its size and its second.
            os.utime(file, (stat.st_atime, stat.st_mtime + 10.0))
            yield
        finally:
            file.write_bytes(source)
            os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))

    def _run(
        self, test: str, limit_s: float, kernels: Path, bytecode: bool = False
    ) -> tuple[int, float, float]:
        """pytest's exit code for a file, -1 if it takes longer than `limit_s`; the time that it took, and its seconds
        of a processor."""
        words = (sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider")
        began_s, before_s = time.monotonic(), _children_s()
        process = subprocess.Popen(
            [*words, f"--basetemp={self._root.parent / 'pytest'}", test],
            cwd=self._root,
            env=self._environment(kernels, bytecode),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            code = process.wait(limit_s)
        except subprocess.TimeoutExpired:
            code = -1
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        return code, time.monotonic() - began_s, _children_s() - before_s

    def _environment(self, kernels: Path, bytecode: bool) -> dict[str, str]:
        return {
            **os.environ,
            **dict.fromkeys(ONE_THREAD, "1"),
            "PYTHONPATH": str(self._root),
            "PYTHONDONTWRITEBYTECODE": "" if bytecode else "1",
            "NUMBA_CACHE_DIR": str(kernels),
        }


def _children_s() -> float:
    """Seconds of a processor that the programs which this one started, and which have ended, took so far."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
