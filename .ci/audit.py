"""Known holes in the installed packages: pip-audit, in an environment of its checker, over a named environment.

A hole is reported and fails nothing: one that became known today must not stop a change that has nothing to do with
it. If the index or its list of holes does not answer, that is reported, and nothing is taken for safe.
"""

import json
import subprocess
import sys
import tempfile
import venv
from pathlib import Path
from typing import Any

VERSION = "2.10.1"
PATIENCE_S = 300


def sentences(report: dict[str, Any]) -> list[str]:
    """A report of pip-audit in sentences, the last of which says of how many packages it tells."""
    packages = report.get("dependencies", [])
    asked = [package for package in packages if "skip_reason" not in package]
    if not asked:
        return ["audit: skipped, the list of known holes does not answer for any package"]
    lines = []
    for package in asked:
        for hole in package["vulns"]:
            better = ", ".join(hole.get("fix_versions", [])) or "none yet"
            lines.append(
                f"audit: HOLE {package['name']} {package['version']}: {hole['id']}, mended in {better}"
            )
    without = len(packages) - len(asked)
    unknown = f"; of {without} nothing is known" if without else ""
    return [*lines, f"audit: {len(lines)} known holes in {len(asked)} packages{unknown}"]


def audited(environment: Path) -> list[str]:
    """The report of pip-audit on the packages in a virtual environment."""
    folders = [str(folder) for folder in environment.glob("lib/python*/site-packages")]
    if not folders:
        return [f"audit: skipped, {environment} is no environment"]
    with tempfile.TemporaryDirectory() as place:
        checker, report = Path(place) / "checker", Path(place) / "report.json"
        venv.create(checker, with_pip=True)
        python = str(checker / "bin" / "python")
        paths = [word for folder in folders for word in ("--path", folder)]
        steps = (
            [python, "-m", "pip", "install", "--quiet", f"pip-audit=={VERSION}"],
            [
                python,
                "-m",
                "pip_audit",
                *paths,
                "--format=json",
                f"--output={report}",
                "--progress-spinner=off",
            ],
        )
        for step in steps:
            try:
                subprocess.run(step, check=False, timeout=PATIENCE_S, capture_output=True)
            except subprocess.TimeoutExpired:
                return [f"audit: skipped, the index does not answer within {PATIENCE_S} s"]
        if not report.exists():
            return ["audit: skipped, the index or its list of known holes does not answer"]
        return sentences(json.loads(report.read_text(encoding="utf-8")))


if __name__ == "__main__":
    sys.stdout.write("".join(f"{line}\n" for line in audited(Path(sys.argv[1]))))
