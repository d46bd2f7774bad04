"""Numbers on the command line are refused before anything begins."""

import pytest

from tui import cli, exit_codes


@pytest.mark.parametrize(
    "line",
    [
        ["simulate", "--vehicle", "ruvifist:hovering", "--mission", "validation", "--seed", "-1"],
        ["demo", "--seed", "one"],
        ["record", "--link", "udpin:127.0.0.1:0", "--seconds", "-1"],
        ["record", "--link", "udpin:127.0.0.1:0", "--seconds", "nan"],
        ["params", "show", "--link", "udpin:127.0.0.1:0", "--seconds", "inf"],
        ["identify", "x.tlog", "--vehicle", "ruvifist", "--method", "paper", "--network", "0", "5", "100"],
    ],
)
def test_a_number_that_makes_no_sense_is_wrong_usage(line, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(line) == exit_codes.BAD_INPUT
    assert "is not a" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
