"""Every command that is said for the crew to paste is one that a shell takes, whatever the folders are called."""

import shlex
from pathlib import Path

import pytest

from bridge.errors import ConfigError
from bridge.signing.key import read_key
from bridge.wire.whole_recording import unmerged_words
from gcs_plugin.doctor.pulses import confirm
from gcs_plugin.params.receipt import PastUpload
from gcs_plugin.params.sidecar import Sidecar
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.params.unfinished import reminder
from tui.commands.plan import joint
from tui.unsent_diagnosis import how_to_send

BEFORE = Path("our receipts/2026-11-20T091200Z-before.param")
WANTED = Path("our receipts/2026-11-20T091200Z-wanted.param")


def key_in(path):
    with pytest.raises(ConfigError) as refused:
        read_key(path)
    return str(refused.value)


def not_confirmed(name):
    with pytest.raises(ConfigError) as refused:
        confirm(name, "")
    return str(refused.value)


def left(restores=""):
    return " ".join(reminder(PastUpload(BEFORE, 1, Outcome.BEGUN, restores, {}, {}, None), {}))


def of_key_others_read(tmp_path):
    path = tmp_path / "our key"
    path.touch(mode=0o644)
    return key_in(path), ("chmod", "600", path)


class Proposal:
    before = (1.0,)


@pytest.mark.parametrize(
    ("words", "command"),
    [
        (lambda: unmerged_words(Path("a dive"), [Path("a dive/b.tlog")]),
         ("seatrial", "merge", "a dive", "a dive/b.tlog")),
        (lambda: key_in(Path("my key")), ("seatrial", "keys", "make", "my key")),
        (left, ("params", "upload", WANTED)),
        (lambda: left(str(BEFORE)), ("params", "rollback", BEFORE)),
        (lambda: how_to_send(Path("our models/a.param"), Sidecar("", "", "", "", "")),
         ("seatrial", "params", "upload", "our models/a.param")),
        (lambda: joint(Proposal, "last dive/identified.json")[1],
         ("seatrial", "prior", "last dive/identified.json")),
        (lambda: not_confirmed("our ROV"), ("--confirm", "our ROV")),
    ],
)  # fmt: skip
def test_a_path_with_a_space_stands_in_quotes(words, command):
    assert shlex.join(map(str, command)) in words()


def test_a_key_that_others_can_read_is_closed_to_them_by_a_command_to_paste(tmp_path):
    words, command = of_key_others_read(tmp_path)
    assert shlex.join(map(str, command)) in words
