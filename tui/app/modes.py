"""The app's orders to the vehicle: the feed-forward forced off, raised, lowered; the end of a flight."""

from collections.abc import Callable

from bridge.vehicle.mode import Mode, word_of
from gcs_plugin.watch.picture import Armed
from tui.app.jobs import JobState
from tui.app.next_step import Flight, lowered_to, raised_to
from tui.app.read_situation import ORDER, read_situation
from tui.app.recordings import TELL_S, Recordings
from tui.app.screens.fly import FLY, flight_of
from tui.app.screens.overlays import AskScreen
from tui.app.screens.parameters_transfer import ARMED, agrees
from tui.app.view import View

BEING_SET = "a mode is on its way to the vehicle already"


class Modes(Recordings):
    """The app's actions on the feed-forward's mode and on the flight that runs."""

    _ordered: JobState | None = None
    _off_may_end = False

    def action_force_off(self) -> None:
        """Force the feed-forward off without asking. The order uses the recording's links; begin one if none runs.

        An order for another mode that is on its way is ended: it may not have begun to look out for OFF yet.
        """
        self._views.force_off()
        self._off_may_end = False
        self.desk.jobs.cancel(ORDER)
        self._off_may_record = True
        if not self._views.view().records:
            self._record_for_off()
        self._show()

    def _is_off_under_way(self) -> bool:
        """Whether OFF is sent, and not every vehicle has said yet that it is off."""
        forcing = self._views.view().forcing
        return forcing is not None and not forcing.done

    def action_raise_ff(self) -> None:
        """Ask for the words that raise the feed-forward by one step, if its gate lets it."""
        view = self._views.view()
        mode, why = raised_to(read_situation(self.desk, view))
        if mode is None or self.desk.jobs.runs(ORDER):
            self.notify(f"not raised: {why or BEING_SET}", severity="warning")
            return

        def is_armed() -> bool:
            return self._views.view().picture.armed is not Armed.DISARMED

        def asked() -> str:
            return f"{ARMED} {mode.word.upper()}" if is_armed() else mode.word.upper()

        def answered(typed: str | None) -> None:
            if typed is not None and (other := self._is_other(mode, view)):
                self.notify(f"not raised: {other}", severity="warning")
            elif typed is not None and agrees(typed, asked()):
                self._send_mode(mode, view, *(() if is_armed() else ("--disarmed",)))
            elif typed is not None:
                self.notify(f"'{typed}' is not {asked()}: nothing was sent", severity="warning")

        title = (
            f"Type {asked()} to set the feed-forward of vehicle {view.picture.links[0].system} to {mode.word}"
        )
        self.push_screen(AskScreen(title, "sends it"), answered)

    def action_lower_ff(self) -> None:
        """Set a feed-forward that acts to shadow, without asking: less of it is the safer mode."""
        view = self._views.view()
        mode, why = lowered_to(read_situation(self.desk, view))
        if mode is None or self.desk.jobs.runs(ORDER):
            self.notify(f"not lowered: {why or BEING_SET}", severity="warning")
            return
        self._send_mode(mode, view)
        self._warn(
            f"vehicle {view.picture.links[0].system} is being set to {mode.word}",
            lambda: self.desk.jobs.runs(ORDER),
            "information",
        )

    def action_end_flight(self) -> None:
        """The end key of the flight that runs."""
        jobs = self.desk.jobs
        flight = flight_of(jobs)
        if not jobs.press(FLY):
            self.notify(
                "no flight runs that was begun here; one of `seatrial fly` ends by any key in its terminal; FF off, "
                "sticks and disarming work as always"
            )
        elif flight is Flight.UNDER_WAY:
            self._warn(
                "the flight is ended: it holds its place; again disarms it",
                lambda: flight_of(jobs) is Flight.UNDER_WAY,
            )
        else:
            self._warn("the work on the flight is ended", lambda: jobs.runs(FLY))

    def _is_other(self, mode: Mode, asked: View) -> str:
        """Why a mode must not be set any more that was asked about with this view; "" if all is as it was."""
        view = self._views.view()
        now, why = raised_to(read_situation(self.desk, view))
        if now is None or self.desk.jobs.runs(ORDER):
            return why or BEING_SET
        if now is not mode or view.picture.links[0].system != asked.picture.links[0].system:
            return "the vehicle is another, or in another mode, since this was asked; nothing was sent, ask again"
        return ""

    def _send_mode(self, mode: Mode, view: View, *more: str) -> None:
        """Set the feed-forward of the vehicle on screen, with `more` options of the verb."""
        system = str(view.picture.links[0].system)
        self.desk.jobs.start(ORDER, (ORDER, mode.word, "--yes", *more, "--system", system, *self.desk.way))
        self._ordered = self.desk.jobs.state(ORDER)

    def _tell_ordered(self) -> None:
        state = self.desk.jobs.state(ORDER)
        if self._ordered is None or state is None or state.done is None:
            return
        self._ordered = None
        result = state.done.result if state.unkept is None else state.unkept
        if result is not None and result.get("done"):
            mode = result["mode"]
            words = f"feed-forward in {mode}, as the vehicle says"
            self._warn(words, self._stays_in(mode), "information", TELL_S)
            return
        # An order that another program's OFF overruled is no error of its program: its answer says so.
        why = result["seen"] if result else state.failure
        why = "OFF was ordered meanwhile and wins" if state.cancelled else why
        self.notify(f"feed-forward not set: {why}", severity="error", timeout=TELL_S)

    def _stays_in(self, mode: str) -> Callable[[], bool]:
        """Whether the vehicle is still in a mode, once it was seen in it: what is shown comes after the answer."""
        seen = False

        def holds() -> bool:
            nonlocal seen
            now = self._views.view().picture.ff_mode
            seen = seen or (now is not None and word_of(now) == mode)
            return not seen or now is None or word_of(now) == mode

        return holds
