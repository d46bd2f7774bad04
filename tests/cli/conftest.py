"""Running a command line that must be refused: one sentence, an exit code and no traceback."""

import pytest

from bridge import exit_codes
from tui import cli


@pytest.fixture
def refused(capsys):
    """Runs a command line that must fail with `code`, and returns its error message, on one line."""

    def run(*line, code=exit_codes.BAD_INPUT):
        capsys.readouterr()
        assert cli.main([str(word) for word in line]) == code
        error = capsys.readouterr().err
        complaints = [text for text in error.splitlines() if text.startswith("seatrial: ")]
        assert len(complaints) == 1, error
        assert "Traceback" not in error
        return " ".join(error.split())

    return run
