"""The firmware's process, with a program in its place."""

import os
from types import SimpleNamespace

import pytest

from bench.ardusub import firmware
from bridge.errors import LinkError


def test_a_firmware_that_does_not_start_is_ended(tmp_path, monkeypatch):
    program = tmp_path / "ardusub"
    program.write_text('#!/bin/sh\necho $$ >"$(dirname "$0")/number"\nexec sleep 30\n', encoding="ascii")
    program.chmod(0o755)

    def refused(_):
        while not (number := tmp_path / "number").exists() or not number.read_text():
            pass
        raise LinkError("nothing listens")

    monkeypatch.setattr(firmware, "START_S", 0.1)
    monkeypatch.setattr(firmware, "open_link", refused)
    with pytest.raises(LinkError, match="the firmware did not start"):
        firmware.Firmware(program, tmp_path / "folder", SimpleNamespace(step_hz=200.0, time_s=0.0))
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "number").read_text()), 0)
