"""What of the store is in force after a start: the mode, and the set where it was committed on this very hull.

A model of another hull or other thrusters may be within all bounds and push a vehicle into the quay. So each set is
kept with the mark of the hull on which it was committed (`bridge.vehicle.hull`) and is in force on that hull alone. It
stays in the store, and comes back with its hull.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from bridge import parameter_store
from bridge.errors import ParamError
from bridge.parameter_row import Parameter, to_float32
from bridge.parameter_store import UNTOLD, Stored

OF_ANOTHER: Final = (
    "FF off: set is of another hull or thrusters",
    "upload a set, or put the vehicle file back",
)
OF_NONE: Final = (
    "FF off: no telling of which hull the set is",
    "look at the vehicle file, then upload again",
)


class Memory:
    """What the file at `path` keeps for `hull`; nothing is kept where `path` is None.

    `mode` is FF_MODE. `committed` is the set that was committed on this hull, whole; None where none was. `why` says
    in words for the crew why the feed-forward has to stay at zero all the same, as a set is kept that is of another
    hull; () where there is no such reason. `offered` is what to stage in that case, None for the vehicle file's model:
    the set of an earlier version, which told no hull. `texts` and `trouble` say what was wrong with the file.
    """

    def __init__(self, path: Path | None, hull: str, table: Mapping[str, Parameter]) -> None:
        self.mode = 0.0
        self.committed: dict[str, float] | None = None
        self.offered: dict[str, float] | None = None
        self.why: tuple[str, ...] = ()
        self.texts: list[str] = []
        self.trouble = ""
        self._path, self._hull, self._table = path, hull, table
        self._others: dict[str, Stored] = {}
        if path is not None:
            self._load(path)

    def save(self, mode: float, committed: Mapping[str, float] | None) -> None:
        """Keep both for this hull, beside what is kept for others. Raises ParamError where the disk doesn't take it."""
        if self._path is not None:
            parameter_store.save(self._path, {**self._others, self._hull: Stored(mode, committed)})

    def _load(self, path: Path) -> None:
        try:
            self._others = parameter_store.load(path)
            own = self._others.pop(self._hull, None)
            if own is not None and not self._fits(own):
                raise ParamError("stored parameters don't fit this vehicle file")
        except ParamError:
            self._others = {}
            self.texts.append("stored parameters unusable, defaults in force")
            self._put_aside(path)
            return
        if own is None:
            own = self._the_files_own_model()
        if own is not None:
            self.mode, self.committed = own.mode, self._whole(own)
        if self.committed is None:
            self._doubt(path)

    def _the_files_own_model(self) -> Stored | None:
        """What an earlier version kept where no set was committed: the model of this very file, or none. It is taken
        over; None where a set was committed, or nothing is kept of an earlier version."""
        untold = self._others.get(UNTOLD)
        if untold is None or not self._fits(untold):
            return None
        defaults = {name: row.default for name, row in self._table.items()}
        if self._whole(untold) not in (None, defaults):
            return None
        del self._others[UNTOLD]
        return Stored(untold.mode, None)

    def _doubt(self, path: Path) -> None:
        """Where nothing was committed on this hull: say so if something was on another."""
        hulls = {hull for hull, stored in self._others.items() if stored.active is not None}
        if hulls == {UNTOLD}:
            untold = self._others[UNTOLD]
            self.offered = self._whole(untold) if self._fits(untold) else None
            self.why = OF_NONE
            known = "an earlier version committed the stored set and did not keep of which hull and thrusters it is"
            do = "if the vehicle file is the one that it was identified with, upload it again; else identify anew"
        elif hulls:
            self.why = OF_ANOTHER
            known = "the stored set was committed for another hull or other thrusters than the vehicle file has now"
            do = (
                "upload a set of this vehicle, or put the vehicle file back, which brings the stored set back"
            )
        else:
            return
        self.texts += self.why
        self.trouble = f"{path}: {known}; the feed-forward stays at zero: {do}"

    def _fits(self, stored: Stored) -> bool:
        if stored.mode not in (0.0, 1.0, 2.0, 3.0):
            return False
        if stored.active is None:
            return True
        needed = {name for name, row in self._table.items() if not row.later}
        return needed <= set(stored.active) <= set(self._table) and all(
            self._table[name].admits(value) and to_float32(value) == value
            for name, value in stored.active.items()
        )

    def _whole(self, stored: Stored) -> dict[str, float] | None:
        """Its set with a value for every row."""
        if stored.active is None:
            return None
        return {name: stored.active.get(name, row.default) for name, row in self._table.items()}

    def _put_aside(self, path: Path) -> None:
        try:
            aside = parameter_store.put_aside(path)
            self.texts.append(f"damaged file kept: {aside.name}"[:50])
            self.trouble = (
                f"{path}: the stored parameters can't be used and lie in {aside}; defaults are in force"
            )
        except ParamError:
            self.texts.append("damaged parameter file can't be put aside")
            self.trouble = (
                f"{path}: the stored parameters can't be used, nor put aside; defaults are in force"
            )
