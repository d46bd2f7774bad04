"""A replay that stands still."""

from dataclasses import replace

from made_view import picture

from tui.app.view import Replayed


def replayed(**what):
    return replace(Replayed("2026-11-21T0352Z-hovering", picture(), 192.0, 807.0, 4.0, False), **what)


class StillReplay:
    """A replay that stands still, and counts what it is told."""

    def __init__(self, shown=None):
        quiet = replace(picture(), said=(), armed_age_s=0.2)
        self.now, self.told = shown or replayed(picture=quiet), []

    def shown(self):
        return self.now

    def toggle(self):
        self.told.append("toggle")

    def seek(self, by_s):
        self.told.append(by_s)

    def faster(self, steps):
        self.told.append(f"{steps:+d}")
