"""The adapter for MAVProxy: thin, of its own licence, imported by nobody else."""

import types
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ADAPTER = ROOT / "gcs_plugin" / "mavproxy.py"


def test_nothing_else_imports_the_adapter_and_it_says_its_licence():
    rooms = [ROOT / room for room in ("bridge", "gcs_plugin", "identify", "tui")]
    sources = [path for room in rooms for path in room.rglob("*.py") if path != ADAPTER]
    assert len(sources) > 20
    for path in sources:
        text = path.read_text(encoding="utf-8")
        assert "import MAVProxy" not in text
        assert "from MAVProxy" not in text
        assert "import gcs_plugin.mavproxy" not in text
        assert "from gcs_plugin.mavproxy" not in text
    assert ADAPTER.read_text(encoding="utf-8").startswith("# SPDX-License-Identifier: GPL-3.0-or-later")


def test_mavproxy_loads_the_adapter_and_runs_its_command(tmp_path, monkeypatch):
    pytest.importorskip("MAVProxy", reason="MAVProxy is not installed: pip install -e .[mavproxy]")
    from gcs_plugin import mavproxy

    lines = []
    state = types.SimpleNamespace(
        console=types.SimpleNamespace(writeln=lines.append),
        command_map={},
        completions={},
        settings=None,
        status=None,
        mav_param={"FF0_M_U": 24.0},
        public_modules={},
        multi_instance={},
        instance_count={},
    )
    monkeypatch.setattr(mavproxy.mp_module.MPModule, "mav_param", property(lambda _: state.mav_param))
    module = mavproxy.init(state)
    file = tmp_path / "set.param"
    file.write_text("FF0_M_U,24.5\n")
    module.command(["status"])
    module.command(["params", str(file)])
    module.command(["record", "start", str(tmp_path / "dives")])
    module.command(["record", "stop"])
    module.command(["nonsense"])
    assert lines[0] == "nothing heard yet"
    assert lines[1].split("  ") == ["FF0_M_U", "24", "24.5", "changed"]
    assert lines[-1] == mavproxy.USAGE
    assert len(list((tmp_path / "dives").iterdir())) == 1
