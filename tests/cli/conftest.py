"""Command lines that are refused: a clear sentence, an exit code, no traceback."""

import pytest

from bridge import exit_codes
from tui import cli


@pytest.fixture
def refused(capsys):
    """Run a command line that must fail: what it says, on one line."""

    def run(*line, code=exit_codes.BAD_INPUT):
        capsys.readouterr()
        assert cli.main([str(word) for word in line]) == code
        error = capsys.readouterr().err
        complaints = [text for text in error.splitlines() if text.startswith("seatrial: ")]
        assert len(complaints) == 1, error
        assert "Traceback" not in error
        return " ".join(error.split())

    return run
