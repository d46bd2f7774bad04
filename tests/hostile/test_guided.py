"""Fuzzing that is guided by coverage finds nothing that stops a parser, or a reader of files."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest
from figures import keep
from fuzz_files import READERS
from fuzz_streams import STREAMS

HERE = Path(__file__).resolve().parent
MINUTES = 10.0

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("atheris") is None, reason="needs pip install 'atheris>=3'"
)


def find_nothing(names, folder):
    seconds = round(60 * MINUTES / len(names))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(HERE.parents[1]), str(HERE), *sys.path))}
    for number, name in enumerate(names):
        command = [sys.executable, str(HERE / "guided.py"), name, str(seconds), str(folder / str(number))]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{name}: {done.stderr[-4000:]}"


@pytest.mark.soak
def test_nothing_new_is_found_in_ten_minutes(tmp_path):
    find_nothing([stream.name for stream in STREAMS], tmp_path)
    keep("hostile_guided", f"{MINUTES:.0f} min over {len(STREAMS)} parsers, nothing found")


@pytest.mark.soak
def test_no_file_is_found_in_ten_minutes_that_gets_more_than_a_sentence(tmp_path):
    find_nothing([reader.name for reader in READERS], tmp_path)
    keep("hostile_guided_files", f"{MINUTES:.0f} min over {len(READERS)} readers, nothing found")
