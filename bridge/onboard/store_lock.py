"""One program at a time for each file of parameters: a second would overwrite what the first was given to keep."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bridge.exit_codes import UsageError
from bridge.locks import held_alone, holder_of


@contextmanager
def alone_with(store: Path, program: str, way_out: str) -> Iterator[None]:
    """Context in which no other program keeps parameters in the file `store`.

    Raises UsageError if one does already: another `program`, such as "bridge", with `way_out` for this one.
    """
    lock = store.with_name(f"{store.name}.lock")
    with held_alone(lock) as is_alone:
        if is_alone:
            yield
            return
        process = holder_of(lock)
    other = f"another {program} (process {process})" if process else f"another {program}"
    raise UsageError(f"{store}: {other} keeps its parameters there: end that one, or give {way_out}")
