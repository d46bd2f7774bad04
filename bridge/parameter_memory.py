"""The part of the store that is in force after a start: the mode, and the set if it was committed on this hull.

A model of another hull or other thrusters may lie within all bounds and still push a vehicle into the quay. So each
set is kept with the mark of the hull on which it was committed (`bridge.vehicle.hull`) and is in force on that hull
only. On other hulls it stays in the store, and it is in force again when its hull is back.
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
    """Contents of the file at `path` for the hull with the mark `hull`; nothing is kept if `path` is None.

    `mode` is FF_MODE. `committed` is the complete set that was committed on this hull, None if there is none. `why`
    holds texts for the crew about why the feed-forward must stay at zero although the store holds a set: the set is
    of another hull, or of an unknown one; () if there is no such reason. `offered` is the set to stage in that case,
    which an earlier version stored without a hull mark; None stands for the vehicle file's model. `texts` and
    `trouble` say what is wrong with the file or its sets, for STATUSTEXT and as a sentence.
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
        """Store mode and set of this hull next to those of other hulls. Raises ParamError if the disk refuses."""
        if self._path is not None:
            parameter_store.save(self._path, {**self._others, self._hull: Stored(mode, committed)})

    def _load(self, path: Path) -> None:
        try:
            self._others = parameter_store.load(path)
            ours = self._others.pop(self._hull, None)
            if ours is not None and not self._fits(ours):
                raise ParamError("stored parameters don't fit this vehicle file")
        except ParamError:
            self._others = {}
            self.texts.append("stored parameters unusable, defaults in force")
            self._put_aside(path)
            return
        if ours is None:
            ours = self._the_files_own_model()
        if ours is not None:
            self.mode, self.committed = ours.mode, self._whole(ours)
        if self.committed is None:
            self._doubt(path)

    def _the_files_own_model(self) -> Stored | None:
        """Take over the mode that an earlier version stored if no set was committed then, and return it.

        A stored set that equals this vehicle file's model counts as not committed. None if another set was committed,
        or if nothing is stored by an earlier version.
        """
        untold = self._others.get(UNTOLD)
        if untold is None or not self._fits(untold):
            return None
        defaults = {name: row.default for name, row in self._table.items()}
        if self._whole(untold) not in (None, defaults):
            return None
        del self._others[UNTOLD]
        return Stored(untold.mode, None)

    def _doubt(self, path: Path) -> None:
        """Report that nothing was committed on this hull if something was committed on another."""
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
        """Return the stored set with a value for every row of the table, or None if no set is stored."""
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
