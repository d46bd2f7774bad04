"""The adapter for MAVProxy: of its own licence, imported by nobody else."""

import re
from pathlib import Path


def test_nothing_else_imports_the_adapter_and_each_of_its_files_says_its_licence():
    root = Path(__file__).resolve().parents[2]
    adapter = root / "gcs_plugin" / "mavproxy"
    sources = [
        path for room in ("bridge", "gcs_plugin", "identify", "tui") for path in (root / room).rglob("*.py")
    ]
    assert len(sources) > 20
    for path in sources:
        text = path.read_text(encoding="utf-8")
        if adapter in path.parents:
            assert text.startswith("# SPDX-License-Identifier: GPL-3.0-or-later"), path
        else:
            assert not re.search(r"(import|from) (MAVProxy|gcs_plugin\.mavproxy)", text), path
