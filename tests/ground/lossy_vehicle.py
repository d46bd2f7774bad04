"""A vehicle's parameters behind a bad link, in simulated time; its faults are switches."""

import heapq
import itertools
import random
from dataclasses import dataclass, field

from bridge.vehicle.parameters import ACTIVE, COMMIT, set_crc
from gcs_plugin.params import float32
from gcs_plugin.params.listing import ReadIndex, ReadList
from gcs_plugin.params.plan import is_staged
from gcs_plugin.params.transfer import Outcome, ReadValue, SetValue

SOURCE = (1, 191)
STEP_S = 0.05
NO_INDEX = 65535


@dataclass
class Faults:
    """What goes wrong: the link by probability, the vehicle by parameter name or time."""

    loss: float = 0.0
    duplicate: float = 0.0
    delay_s: float = 0.02  # at most, drawn for each message: they overtake
    late_s: float = 0.0  # each message, beside that
    stores_other: dict = field(default_factory=dict)  # takes the write, echoes it, and stores this instead
    refuses: set = field(default_factory=set)  # answers the new value, then the old one, and keeps the old
    mute: set = field(default_factory=set)  # never answers a write
    coalesces: bool = False  # echoes only every third write
    errors: bool = False  # sends PARAM_ERROR beside the value
    armed: bool = False  # commits are refused
    reboots_s: tuple = ()
    forgets_staging: bool = False
    cut_s: float = float("inf")  # nothing gets through any more


class LossyVehicle:
    """Answers reads and writes over a network that loses, doubles, delays and reorders."""

    def __init__(self, values, faults=None, seed=0, commits=True):
        self.values = {name: float32.rounded(value) for name, value in values.items()}
        self.faults = faults or Faults()
        self.rng = random.Random(seed)
        self.now_s = 0.0
        self.commits = commits
        if commits:
            self.values |= {COMMIT: 0.0, ACTIVE: float(set_crc(self.staged()))}
        self.flying = self.staged()
        self.writes = 0
        self.sends = 0
        self._dead_until_s = 0.0
        self._events = []
        self._order = itertools.count()
        self._reboots_s = sorted(self.faults.reboots_s)

    def staged(self):
        return {name: value for name, value in self.values.items() if is_staged(name)}

    def run(self, machine, done, until_s=600.0):
        """Drive `machine` until `done()`; False where time ran out."""
        while not done():
            if self.now_s > until_s:
                return False
            for send in machine.tick(self.now_s):
                self.sends += 1
                self._carry(lambda _, send=send: self._receive(send))
            self._step(machine)
        return True

    def settle(self, machine, for_s=5.0):
        """Let all that is still under way arrive, so that the truth is the last word."""
        end_s = self.now_s + for_s
        while self.now_s < end_s:
            self._step(machine)

    def _step(self, machine):
        self.now_s = round(self.now_s + STEP_S, 6)
        while self._events and self._events[0][0] <= self.now_s:
            heapq.heappop(self._events)[2](machine)
        if self._reboots_s and self.now_s >= self._reboots_s[0]:
            self._reboots_s.pop(0)
            self._reboot()

    def _carry(self, action):
        if self.now_s >= self.faults.cut_s or self.rng.random() < self.faults.loss:
            return
        for _ in range(2 if self.rng.random() < self.faults.duplicate else 1):
            when = self.now_s + self.faults.late_s + self.rng.uniform(0.0, self.faults.delay_s)
            heapq.heappush(self._events, (when, next(self._order), action))

    def _reboot(self):
        self._dead_until_s = self.now_s + 2.0
        if self.faults.forgets_staging:
            self.values |= self.flying
        told_s = self.now_s + 2.5
        heapq.heappush(self._events, (told_s, next(self._order), lambda m: m.on_reboot(self.now_s)))

    def _receive(self, send):
        if self.now_s < self._dead_until_s:
            return
        if isinstance(send, SetValue):
            self._write(send.name, send.value)
        elif isinstance(send, ReadValue):
            self._answer(send.name) if send.name in self.values else self._error(send.name, 1)
        elif isinstance(send, ReadList):
            for name in self.values:
                self._answer(name)
        elif isinstance(send, ReadIndex):
            self._answer(list(self.values)[send.index])

    def _write(self, name, value):
        self.writes += 1
        if name not in self.values:
            self._error(name, 1)
        elif name in self.faults.refuses:
            self._say(name, value, NO_INDEX)
            self._error(name, 3)
            self._say(name, self.values[name], NO_INDEX)
        elif name == COMMIT:
            if not self.faults.armed and value == set_crc(self.staged()):
                self.flying = self.staged()
                self.values |= {ACTIVE: value, COMMIT: value}
            else:
                self._error(name, 3)
            self._say(COMMIT, self.values[COMMIT], NO_INDEX)
        else:
            self.values[name] = float32.rounded(self.faults.stores_other.get(name, value))
            if name not in self.faults.mute and not (self.faults.coalesces and self.writes % 3):
                self._say(name, value, NO_INDEX)

    def _answer(self, name):
        self._say(name, self.values[name], list(self.values).index(name))

    def _say(self, name, value, index):
        count = len(self.values)

        def deliver(machine):
            if hasattr(machine, "missing"):
                machine.on_value(name, value, index, count, SOURCE, self.now_s)
            else:
                machine.on_value(name, value, SOURCE, self.now_s)

        self._carry(deliver)

    def _error(self, name, code):
        if self.faults.errors:
            self._carry(lambda machine: self._hear_error(machine, name, code))

    def _hear_error(self, machine, name, code):
        if hasattr(machine, "ending"):
            machine.on_error(name, code, SOURCE, self.now_s)
        elif not hasattr(machine, "missing"):
            machine.on_error(name, code, SOURCE)


def flown(values):
    """Those of the values that fly once they are committed."""
    return {name: value for name, value in values.items() if is_staged(name)}


def is_told_as_it_is(vehicle, ending, old, new):
    """No claim of an upload from `old` to `new` that is not so, and the set that flies is whole."""
    held = {name: vehicle.values[name] for name in old}
    assert vehicle.flying in (flown(old), flown(new))
    if ending.outcome is Outcome.APPLIED:
        assert (held, vehicle.flying) == (new, flown(new))
    elif ending.outcome is not Outcome.UNVERIFIED:
        assert (held, vehicle.flying) == (old, flown(old))
    for values, outcome in ((new, Outcome.APPLIED), (old, Outcome.ROLLED_BACK)):
        claimed = {name for name, result in ending.results.items() if result.outcome is outcome}
        assert {name: held[name] for name in claimed} == {name: values[name] for name in claimed}
