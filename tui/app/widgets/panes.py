"""Sensors, thrusters and the vehicle's messages, and the headings above them."""

from collections.abc import Callable

from tui.app import panes
from tui.app.lines import Lines, heading
from tui.app.view import View
from tui.app.widgets.line_view import LineView


class Heading(LineView):
    """A title with a rule, and a note at the right that may depend on the view."""

    def __init__(self, title: str, note: Callable[[View], str] = lambda _: "") -> None:
        super().__init__()
        self._title, self._note = title, note

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        del rows
        return (heading(self._title, self._note(view), cells),)


class SensorTable(LineView):
    """Links and sensors with their freshness."""

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        del rows
        return panes.sensors(view.picture.links, view.picture.sensors, cells)


class ThrusterHeading(LineView):
    """The title of the bars, with the configuration in use."""

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        del rows
        return (panes.thrusters_heading(view.picture.configuration, cells),)


class ThrusterBars(LineView):
    """Thruster commands as signed bars."""

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        del rows
        return panes.thrusters(view.picture.thrusters, cells) or ((("none heard", "quiet"),),)


class Words(LineView):
    """The vehicle's last messages, the newest first."""

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        del rows
        return panes.words(view.picture.said, cells) or ((("nothing said", "quiet"),),)
