"""Modes, staging, arming, reboots, edited vehicle files, full disks, lost grounds and bad parameters in any order,
against a plain model of what is allowed."""

import math
import tempfile
from contextlib import nullcontext
from pathlib import Path
from unittest.mock import patch

import pytest
from figures import keep
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    rule,
    run_state_machine_as_test,
)

from bridge.clock import SimulatedClock
from bridge.errors import ParamError
from bridge.links.link import memory_pair
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.service import Bridge
from bridge.simulator.truth import load_truth
from bridge.vehicle.autopilot import RATE_HZ, Actuation, Autopilot
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.parameters import set_crc, to_float32, vehicle_table
from bridge.vehicle.references import Reference
from bridge.vehicle.thrusters import Allocator, thrust_curve
from bridge.wire.framing import Encoder
from bridge.wire.status_codes import Topic, decoded

FILE = load_vehicle("ruvifist")
SHAPE = FILE.vehicle.configurations["hovering"]
CURVE = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
REACH = tuple(float(limit) for limit in Allocator(SHAPE, CURVE).reach())
TRUE = load_truth(FILE, "hovering").model
VEH_CFG = FILE.vehicle.veh_cfg("hovering")
TICK_S = 1 / RATE_HZ

# What is promised, in its own words: what is taken from the code under test would be wrong along with it.
LEFT_TO_IT = {Mode.OFF: 0, Mode.SHADOW: 0, Mode.BOTH: 1, Mode.ALONE: 2}
STALE_S = 0.5
SLOPE_PER_S = 2.0

SHADOW_S, MOVED_S = 6.0, 4.0
"""In place of a minute and 10 s, so that a machine gets there in a few hundred ticks."""

NAMES = {f"FF{VEH_CFG}_{name.upper()}": name for name in ("M_u", "D_u", "M_v", "D_v", "I_r", "D_r")}
FIT, UNFIT = (1.0, 0.9, 1.1), (3.0, 0.1)
EXACT, NEAR = 1e-6, 0.15
BAD = (math.nan, math.inf, -math.inf, -1.0, 1e30)
AXES = ((0, "M_u", "D_u"), (1, "M_v", "D_v"), (5, "I_r", "D_r"))
HULLS = ("as built", "with other thrusters")
BEAT = Encoder(255, 190).frame(0, bytes(9))
Set = dict[str, float]


class Modes(RuleBasedStateMachine):
    """A vehicle that surges to and fro in water that is exactly its true model's; `events` counts what was tried on all
    of them."""

    events = 0

    def __init__(self) -> None:
        super().__init__()
        self.short = patch.multiple("bridge.vehicle.shadow", WINDOW_S=SHADOW_S, MOVED_S=MOVED_S)
        self.short.start()
        self.folder = tempfile.TemporaryDirectory()
        self.clock = SimulatedClock()
        self.now_s = 0.0
        self.nu = dict.fromkeys(FEEDFORWARD_DOFS, 0.0)
        self.poison: Set = {}
        self.hull = HULLS[0]
        self.kept: dict[str, tuple[Mode, Set | None]] = {}
        self.start()
        self.defaults = {name: self.server.value(name) for name in self.server.names[:-4]}
        self.take_up()

    def teardown(self) -> None:
        self.short.stop()
        self.folder.cleanup()

    def start(self) -> None:
        """The vehicle's programs, anew."""
        self.server = ParameterServer(
            Path(self.folder.name) / "store.json", vehicle_table(FILE.vehicle), hull=self.hull
        )
        self.pilot = Autopilot(
            FILE.vehicle, "hovering", lambda n: {**self.server.active(n), **self.poison}, FILE.path.parent
        )
        self.server.unproven = self.pilot.unproven
        near, self.ground = memory_pair()
        self.bridge = Bridge(FILE.vehicle, self.clock, [near], self.server, veh_cfg=VEH_CFG)

    def take_up(self) -> None:
        """The model after a start: the values kept for this very hull."""
        self.armed, self.disk_is_full = False, False
        self.mode, self.committed = self.kept.get(self.hull, (Mode.OFF, None))
        self.staged = dict(self.committed or self.defaults)
        self.applied, self.scaled = (0.0, 0.0, 0.0), False
        self.off: set[str] = set()
        self.seen: Set = {}
        self.shadow_s = 0.0

    def keep(self) -> None:
        if not self.disk_is_full:
            self.kept[self.hull] = self.mode, self.committed

    def write(self, name: str, value: float) -> bool:
        """A write to the vehicle; whether it was taken."""
        full = patch("bridge.onboard.store.save", side_effect=ParamError("full"))
        with full if self.disk_is_full else nullcontext():
            return self.server.write(name, value, self.armed) is None

    @property
    def flown(self) -> dict[str, float]:
        """The coefficients that the autopilot gets, as the model of this test has them."""
        held = self.committed or {}
        return {
            coefficient: held[name] for name, coefficient in NAMES.items() if held.get(name)
        } | self.poison

    @property
    def misfit(self) -> float:
        """Their error as a share of the water's force; infinite if a value is no number."""
        shares = [abs(self.flown.get(name, 0.0) / TRUE[name] - 1.0) for name in ("M_u", "D_u")]
        return max(math.inf if math.isnan(share) else share for share in shares)

    # What the ground asks.

    @initialize(fit=st.booleans())
    def a_set_is_in_force(self, fit: bool) -> None:
        if fit:
            self.stage_a_model(1.0, 1.0)
            self.commit(True)

    @rule(mass=st.sampled_from(FIT + UNFIT), damping=st.sampled_from(FIT + UNFIT))
    def stage_a_model(self, mass: float, damping: float) -> None:
        for name, coefficient in NAMES.items():
            factor = {"M_u": mass, "D_u": damping}.get(coefficient, 1.0)
            self.stage(name, TRUE[coefficient] * factor)

    @rule(name=st.sampled_from(sorted(NAMES)), value=st.sampled_from(BAD))
    def stage(self, name: str, value: float) -> None:
        if self.write(name, value):
            self.staged[name] = to_float32(value)
        assert math.isfinite(self.server.value(name))

    @rule(right=st.booleans())
    def commit(self, right: bool) -> None:
        crc = set_crc(self.staged)
        taken = self.write("FF_COMMIT", float(crc if right else crc % 2**24 + 1))
        acts = self.armed and LEFT_TO_IT[self.mode] > 0
        assert taken == (right and not acts and not self.disk_is_full)
        if taken:
            self.committed = dict(self.staged)
            self.keep()

    @rule()
    def leave_no_set_in_force(self) -> None:
        acts = self.armed and LEFT_TO_IT[self.mode] > 0
        taken = self.write("FF_COMMIT", 0.0)
        assert taken == (not acts and not self.disk_is_full)
        if taken:
            self.committed = None
            self.keep()

    @rule(mass=st.sampled_from(FIT + UNFIT), damping=st.sampled_from(FIT + UNFIT))
    def commit_another_model_at_any_moment(self, mass: float, damping: float) -> None:
        self.stage_a_model(mass, damping)
        self.what_is_in_force_is_one_committed_set_whole()
        self.commit(False)
        self.commit(True)

    @rule(value=st.sampled_from([0.0, 1.0, 2.0, 3.0, 2.0, 3.0, 1.5, math.nan]))
    def ask_for_a_mode(self, value: float) -> None:
        self.server.take_texts()
        refused = not self.write("FF_MODE", value)
        texts = self.server.take_texts()
        if value not in (0.0, 1.0, 2.0, 3.0):
            assert refused
            return
        wanted, before = Mode(int(value)), self.mode
        if not refused:
            self.mode = wanted
            self.keep()
        if not self.armed or not LEFT_TO_IT[wanted]:
            assert not refused
        elif self.committed is None:
            assert refused
        elif LEFT_TO_IT[wanted] > LEFT_TO_IT[before]:
            # What flew for no tick changed nothing.
            flown = self.flown == self.seen and self.shadow_s >= SHADOW_S + TICK_S - 1e-6
            if not flown or self.misfit > NEAR:
                assert refused
            elif refused:
                # One that is near may be refused where the vehicle ran out, so that hardly a force was given.
                assert self.misfit > EXACT
                assert texts[1].endswith(" % of surge explained, needs 70")
            assert (decoded("".join(texts[:1])).topic is Topic.UNPROVEN) == refused
            assert not refused or decoded(texts[1]).topic is Topic.SHADOW
        else:
            assert not refused
        assert all(len(text) <= 50 for text in texts)

    @rule()
    def off_is_always_taken(self) -> None:
        assert self.write("FF_MODE", 0.0)
        self.mode = Mode.OFF
        self.keep()

    @rule()
    def arm(self) -> None:
        taken = self.bridge.arm(True)
        assert taken == (self.committed is not None or not LEFT_TO_IT[self.mode])
        self.armed = self.armed or taken

    @rule()
    def disarm(self) -> None:
        assert self.bridge.arm(False)
        self.armed = False
        self.fly(0.1)

    @rule(hull=st.sampled_from([HULLS[0], *HULLS]))
    def reboot(self, hull: str) -> None:
        """With the vehicle file as it was, or edited meanwhile."""
        self.hull = hull
        self.start()
        self.take_up()

    @rule(full=st.booleans())
    def the_disk_fills_up_or_has_room(self, full: bool) -> None:
        self.disk_is_full = full

    @rule(breaks=st.booleans(), seconds=st.sampled_from([1.0, 8.0]))
    def the_ground_speaks_and_then_falls_silent_or_its_link_breaks(
        self, breaks: bool, seconds: float
    ) -> None:
        near, self.ground = memory_pair()
        self.bridge = Bridge(FILE.vehicle, self.clock, [near], self.server, veh_cfg=VEH_CFG)
        assert self.bridge.arm(self.armed)
        self.ground.write(BEAT)
        self.fly(0.1)
        if breaks:
            self.ground.close()
        self.fly(seconds)

    @rule(name=st.sampled_from(sorted(NAMES.values())), value=st.sampled_from(BAD))
    def a_coefficient_goes_bad_on_board(self, name: str, value: float) -> None:
        self.poison = {name: value}

    @rule()
    def it_is_well_again(self) -> None:
        self.poison = {}

    # What the vehicle does.

    @rule(
        mass=st.sampled_from(FIT),
        damping=st.sampled_from(FIT + UNFIT),
        then=st.sampled_from([2.0, 3.0]),
        seconds=st.sampled_from([SHADOW_S + 2.5, SHADOW_S - 1.0]),
    )
    def fly_a_shadow(self, mass: float, damping: float, then: float, seconds: float) -> None:
        """Steps to a raise while armed, or to its refusal; other rules come between them."""
        self.off_is_always_taken()
        self.stage_a_model(mass, damping)
        self.commit(True)
        self.ask_for_a_mode(1.0)
        self.arm()
        self.fly(seconds)
        self.ask_for_a_mode(then)
        self.fly(1.0)

    @rule(
        mass=st.sampled_from(FIT + UNFIT),
        then=st.sampled_from([2.0, 3.0]),
        seconds=st.sampled_from([0.0, 1.0]),
    )
    def ask_for_more_with_a_set_that_was_not_flown(self, mass: float, then: float, seconds: float) -> None:
        self.fly_a_shadow(1.0, 1.0, 1.0, SHADOW_S + 2.5)
        self.stage_a_model(mass, 0.9)
        self.commit(True)
        self.fly(seconds)
        self.ask_for_a_mode(then)

    @rule(first=st.sampled_from([2.0, 3.0]), then=st.sampled_from([2.0, 3.0]))
    def arm_with_it_raised_and_ask_for_the_other(self, first: float, then: float) -> None:
        self.disarm()
        self.ask_for_a_mode(first)
        self.arm()
        self.fly(1.0)
        self.ask_for_a_mode(then)

    @rule()
    def fly_long_enough(self) -> None:
        self.fly(SHADOW_S + 2.5)

    @rule(seconds=st.sampled_from([0.05, 1.0, 3.0]))
    def fly(self, seconds: float) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.tick()

    @rule(age_s=st.sampled_from([0.6, 4.0, -2.0]))
    def fly_by_an_old_reference(self, age_s: float) -> None:
        for _ in range(5):
            self.tick(age_s=age_s)

    @rule(speed=st.sampled_from([0.8, -0.8, 30.0, math.nan, math.inf]))
    def fly_by_a_reference_that_jumps(self, speed: float) -> None:
        for _ in range(5):
            self.tick(jump=speed)

    @rule(velocity=st.sampled_from([math.nan, math.inf]))
    def fly_by_a_velocity_that_is_none(self, velocity: float) -> None:
        for _ in range(5):
            self.tick(velocity=velocity)

    def tick(self, age_s: float = math.nan, jump: float | None = None, velocity: float | None = None) -> None:
        self.now_s += TICK_S
        self.clock.advance_to(self.now_s)
        phase = 1.0 * self.now_s
        u, du = (0.2 - 0.2 * math.cos(phase), 0.2 * math.sin(phase)) if jump is None else (jump, 0.0)
        v = r = 0.0 if jump is None else 0.4 * jump
        reference = Reference((u, v, 0, 0, 0, r), (du, 0, 0, 0, 0, 0), 0.0, 0.7, time_s=self.now_s - age_s)
        known = Navigation(
            (self.nu[0] if velocity is None else velocity, self.nu[1], 0.0),
            self.now_s,
            (0.0, 0.0, self.nu[5]),
            self.now_s,
            (1.0, 0.0, 0.0, 0.0),
            0.0,
            self.now_s,
            0.6,
            self.now_s,
        )
        if self.flown != self.seen:
            self.seen, self.shadow_s = self.flown, 0.0
        self.bridge.step()
        self.pilot.mode = Mode(self.server.mode)
        actuation = (self.pilot.step if self.bridge.armed else self.pilot.rest)(self.now_s, known, reference)
        for dof, mass, damping in AXES:
            self.nu[dof] += TICK_S * (actuation.tau_cmd[dof] - TRUE[damping] * self.nu[dof]) / TRUE[mass]
        self.judge(actuation, abs(age_s) > STALE_S, math.isfinite(u))
        limited = self.scaled or any(abs(actuation.tau_ff[dof]) >= REACH[dof] for dof in FEEDFORWARD_DOFS)
        shadowed = self.armed and self.mode is Mode.SHADOW and not limited
        if shadowed and age_s != age_s and math.isfinite(u) and velocity is None and self.committed:
            self.shadow_s += TICK_S
        elif not (self.armed and LEFT_TO_IT[self.mode]):
            self.shadow_s = 0.0

    def judge(self, actuation: Actuation, stale: bool, finite: bool) -> None:
        """Checks of every tick."""
        model = self.flown
        before, self.applied = (
            self.applied,
            tuple(actuation.tau_cmd[d] - actuation.tau_pid[d] for d in FEEDFORWARD_DOFS),
        )
        # Where all thrusters are scaled down together heave tells so, which the feed-forward has no part in.
        scaled, self.scaled = self.scaled, abs(actuation.tau_cmd[2] - actuation.tau_pid[2]) > 1e-6
        off = {"stale"} if stale else set()
        for axis, (dof, mass, damping) in enumerate(AXES):
            assert abs(actuation.tau_ff[dof]) <= REACH[dof]
            bad = [name for name in (mass, damping) if not 0 < model.get(name, -1.0) < 1e6]
            sound = not bad
            if stale or not sound or not finite:
                assert actuation.tau_ff[dof] == 0.0
                off |= set() if stale else {bad[0] if bad else DOFS[dof]}
            if not (self.armed and LEFT_TO_IT[self.mode] and sound and finite and not stale):
                assert self.scaled or abs(self.applied[axis]) <= 1e-6
            elif not (scaled or self.scaled):
                assert abs(self.applied[axis]) <= REACH[dof] + 1e-6
                assert abs(self.applied[axis] - before[axis]) <= SLOPE_PER_S * TICK_S * REACH[dof] + 1e-6
        said = [text for text in self.pilot.take_texts() if decoded(text).words.startswith("FF ")]
        assert all(any(word in text for text in said) for word in off - self.off)
        assert all(len(text) <= 50 for text in said)
        self.off = off

    @invariant()
    def what_is_in_force_is_one_committed_set_whole(self) -> None:
        Modes.events += 1
        assert (self.server.mode, self.bridge.armed) == (self.mode, self.armed)
        assert self.server.active_crc == (set_crc(self.committed) if self.committed else 0)
        held = self.committed or {}
        assert (
            self.server.active(VEH_CFG).items()
            >= {coefficient: held[name] for name, coefficient in NAMES.items() if held.get(name)}.items()
        )
        assert {name: self.server.value(name) for name in self.staged} == self.staged


def run(examples: int, steps: int, derandomize: bool) -> None:
    checks = list(HealthCheck)
    run_state_machine_as_test(
        Modes,
        settings=settings(
            max_examples=examples,
            stateful_step_count=steps,
            derandomize=derandomize,
            suppress_health_check=checks,
        ),
    )


@pytest.mark.slow
def test_no_order_of_events_breaks_what_is_promised_of_the_modes():
    run(20, 30, True)


@pytest.mark.soak
def test_no_order_of_many_thousand_events_breaks_what_is_promised_of_the_modes():
    Modes.events = 0
    run(1000, 100, False)
    keep(
        "feedforward_bounded",
        f"{Modes.events} events in 1000 orders drawn at random (modes, sets, arming, starts anew, edited vehicle "
        "files, full disks, lost grounds, bad coefficients, references and readings), no promise broken",
    )
