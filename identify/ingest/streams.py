"""A recording as streams of named numbers, the form in which every foreign file is read before a column map."""

from dataclasses import dataclass

from identify.dive import Array


@dataclass(frozen=True)
class Stream:
    """Samples of one topic of a recording, or all rows of a table.

    name: of the topic; empty for a file that holds a single table. columns: by name, (n,) each, in the file's own
    units; NaN where a row has no value. Times are columns as well. `text`: columns (n,) of words, which no signal can
    be made of, except times.

    A column map names a column by topic and field, as `/dvl/data.velocity.x`, or by the field alone in a single table.
    """

    name: str
    columns: dict[str, Array]
    text: dict[str, tuple[str, ...]]

    def full_name(self, column: str) -> str:
        """The name that a column map uses."""
        return f"{self.name}.{column}" if self.name else column
