"""Fuzzing that is guided by coverage finds nothing that stops a parser."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest
from figures import keep
from fuzz_streams import STREAMS

HERE = Path(__file__).resolve().parent
MINUTES = 10.0


@pytest.mark.soak
@pytest.mark.skipif(importlib.util.find_spec("atheris") is None, reason="needs pip install 'atheris>=3'")
def test_nothing_new_is_found_in_ten_minutes(tmp_path: Path) -> None:
    seconds = round(60 * MINUTES / len(STREAMS))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(HERE.parents[1]), str(HERE), *sys.path))}
    for number, stream in enumerate(STREAMS):
        command = [
            sys.executable,
            str(HERE / "guided.py"),
            stream.name,
            str(seconds),
            str(tmp_path / str(number)),
        ]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{stream.name}: {done.stderr[-4000:]}"
    keep("hostile_guided", f"{MINUTES:.0f} min over {len(STREAMS)} parsers, nothing found")
