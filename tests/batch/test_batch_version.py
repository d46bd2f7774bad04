"""A result is kept for the code that made it: the stamp of that code moves with it, and covers all of it."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import batch_jobs

from identify.batch import jobs

LOADED = """
import importlib, sys
import identify.batch.diagnose
import identify.batch.work
from identify.estimators.table import METHODS
for module in METHODS.values():
    importlib.import_module(module)
print("\\n".join(m.__file__ for name, m in sys.modules.items() if name.split(".")[0] in ("bridge", "identify")))
"""
NOTHING_TO_ANSWER = ("__init__.py", "version.py")


def test_the_stamp_covers_every_module_that_an_identification_or_a_diagnosis_loads():
    told = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    files = {Path(line) for line in told.stdout.split() if not line.endswith(NOTHING_TO_ANSWER)}
    assert len(files) > 30
    assert files <= set(jobs.answering(jobs.PLACE))


def test_a_job_of_other_code_has_another_key(tmp_path, monkeypatch):
    (path,) = batch_jobs.recordings(tmp_path / "dives", 1)
    job = batch_jobs.job_on(path, "size", batch_jobs.FILE)
    assert batch_jobs.job_on(path, "size", batch_jobs.FILE) == job
    monkeypatch.setattr(jobs, "our_version", lambda: "0.1.0, code 0123456789")
    other = batch_jobs.job_on(path, "size", batch_jobs.FILE)
    assert other.key != job.key
    assert replace(other, key=job.key) == job
