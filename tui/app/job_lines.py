"""A job as lines: its progress while it runs, and the reason if it failed."""

from tui import exit_codes
from tui.app.jobs import JobState
from tui.app.lines import Lines, apart, cut
from tui.app.wrapped import bar, wrapped

BAR_CELLS = 24
NOT_KEPT = "its values are below, and kept nowhere"


def job_lines(verb: str, state: JobState | None, now_s: float, cells: int) -> Lines:
    """Progress or failure of a job; empty if there was no job or if it left a result, which is shown itself."""
    if state is None:
        return ()
    if state.done is None:
        report = state.told[-1] if state.told else None
        share, words = (report.share, report.words) if report else (0.0, "begins")
        left = f" {100 * share:3.0f} %  "
        lasted = f"  {now_s - state.began_s:.0f} s"
        doing = "ends" if state.cancelled else words
        room = cells - BAR_CELLS - len(left) - len(lasted) - 1
        return (
            apart(
                ((bar(share, BAR_CELLS), "accent"), (left, "strong"), (cut(doing, room), "plain")),
                ((lasted, "quiet"),),
                cells,
            ),
        )
    if state.cancelled:
        return wrapped(f"{verb} was cancelled; nothing of it was kept", "warn", cells)
    if state.done.result is None or state.done.code == exit_codes.BAD_INPUT:
        why = state.done.why
        if state.unkept is not None:
            why += f"; {NOT_KEPT}"
        return wrapped(why or f"{verb} ended with exit code {state.done.code} and said nothing", "bad", cells)
    return ()
