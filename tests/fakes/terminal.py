"""Standard input in place of a terminal at which somebody types, or of none."""


class Terminal:
    """Somebody who types; `asked` is called as they begin."""

    def __init__(self, typed, asked=lambda: None):
        self.typed, self.asked = typed, asked

    def isatty(self):
        return True

    def readline(self):
        self.asked()
        return self.typed


def nobody(monkeypatch):
    """There is no terminal."""
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
