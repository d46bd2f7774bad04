"""Modes, staging, arming, reboots and bad parameters in any order, against a plain model of what is allowed."""

import math
import tempfile
from pathlib import Path
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    rule,
    run_state_machine_as_test,
)

from bridge.navigation import Navigation
from bridge.parameter_row import to_float32
from bridge.parameters import ParameterServer, set_crc, vehicle_table
from bridge.simulator.truth import load_truth
from bridge.vehicle.autopilot import RATE_HZ, REFERENCE_STALE_S, Autopilot
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS, SLOPE_PER_S, Mode
from bridge.vehicle.references import Reference
from bridge.vehicle.thrusters import Allocator, thrust_curve

FILE = load_vehicle("ruvifist")
SHAPE = FILE.vehicle.configurations["hovering"]
CURVE = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
REACH = tuple(float(limit) for limit in Allocator(SHAPE, CURVE).reach())
TRUE = load_truth(FILE, "hovering").model
VEH_CFG = FILE.vehicle.veh_cfg("hovering")
TICK_S = 1 / RATE_HZ

SHADOW_S, MOVED_S = 6.0, 4.0
"""In place of a minute and 10 s, so that a machine gets there in a few hundred ticks."""

NAMES = {f"FF{VEH_CFG}_{name.upper()}": name for name in ("M_u", "D_u", "M_v", "D_v", "I_r", "D_r")}
FIT, UNFIT = (1.0, 0.9, 1.1), (3.0, 0.1)
BAD = (math.nan, math.inf, -math.inf, -1.0, 1e30)


class Modes(RuleBasedStateMachine):
    """A vehicle that surges to and fro in water that is exactly its true model's."""

    def __init__(self) -> None:
        super().__init__()
        self.short = patch.multiple("bridge.vehicle.shadow", WINDOW_S=SHADOW_S, MOVED_S=MOVED_S)
        self.short.start()
        self.folder = tempfile.TemporaryDirectory()
        self.now_s = 0.0
        self.u = 0.0
        self.poison: dict[str, float] = {}
        self.armed = False
        self.mode = Mode.OFF
        self.boot()
        self.defaults = {name: self.server.value(name) for name in self.server.names[:-4]}
        self.staged, self.committed = dict(self.defaults), None

    def teardown(self) -> None:
        self.short.stop()
        self.folder.cleanup()

    def boot(self) -> None:
        self.server = ParameterServer(Path(self.folder.name) / "store.json", vehicle_table(FILE.vehicle))
        self.pilot = Autopilot(
            FILE.vehicle, "hovering", lambda n: {**self.server.active(n), **self.poison}, FILE.path.parent
        )
        self.server.unproven = self.pilot.unproven
        self.applied, self.scaled = (0.0, 0.0, 0.0), False
        self.shadow_s = 0.0

    @property
    def flown(self) -> dict[str, float]:
        """The coefficients that the autopilot gets, as the model of this test has them."""
        held = self.committed or {}
        return {own: held[name] for name, own in NAMES.items() if held.get(name)} | self.poison

    @property
    def fits(self) -> bool:
        """Whether they are near enough to what the water does for a raise while armed."""
        return all(0.85 <= self.flown.get(name, 0.0) / TRUE[name] <= 1.15 for name in ("M_u", "D_u"))

    # What the ground asks.

    @initialize(fit=st.booleans())
    def a_set_is_in_force(self, fit: bool) -> None:
        if fit:
            self.stage_a_model(1.0, 1.0)
            self.commit(True)

    @rule(mass=st.sampled_from(FIT + UNFIT), damping=st.sampled_from(FIT + UNFIT))
    def stage_a_model(self, mass: float, damping: float) -> None:
        for name, own in NAMES.items():
            factor = {"M_u": mass, "D_u": damping}.get(own, 1.0)
            self.stage(name, TRUE[own] * factor)

    @rule(name=st.sampled_from(sorted(NAMES)), value=st.sampled_from(BAD))
    def stage(self, name: str, value: float) -> None:
        if self.server.write(name, value, self.armed) is None:
            self.staged[name] = to_float32(value)
        assert math.isfinite(self.server.value(name))

    @rule(right=st.booleans())
    def commit(self, right: bool) -> None:
        crc = set_crc(self.staged)
        refused = self.server.write("FF_COMMIT", float(crc if right else crc % 2**24 + 1), self.armed)
        assert (refused is None) == (right and not (self.armed and self.mode.applies_feedforward))
        if refused is None and self.committed != self.staged:
            self.committed, self.shadow_s = dict(self.staged), 0.0

    @rule(value=st.sampled_from([0.0, 1.0, 2.0, 3.0, 2.0, 3.0, 1.5, math.nan]))
    def ask_for_a_mode(self, value: float) -> None:
        self.server.take_texts()
        refused = self.server.write("FF_MODE", value, self.armed) is not None
        texts = self.server.take_texts()
        if value not in (0.0, 1.0, 2.0, 3.0):
            assert refused
            return
        wanted, before = Mode(int(value)), self.mode
        if not refused:
            self.mode = wanted
        if not self.armed or not wanted.applies_feedforward:
            assert not refused
        elif self.committed is None:
            assert refused
        elif wanted.raises(before):
            proven = self.shadow_s >= SHADOW_S + 2 * TICK_S and self.fits
            assert refused == (not proven)
            assert (texts[:1] == ["FF_MODE refused: armed, shadow not good yet"]) == refused
            assert not refused or texts[1].startswith("shadow: ")
        else:
            assert not refused
        assert all(len(text) <= 50 for text in texts)

    @rule()
    def off_is_always_taken(self) -> None:
        assert self.server.write("FF_MODE", 0.0, self.armed) is None
        self.mode = Mode.OFF

    @rule()
    def arm(self) -> None:
        # As the bridge does: no arming into a mode that has nothing to apply.
        self.armed = not (self.mode.applies_feedforward and not self.server.active_crc)

    @rule()
    def disarm(self) -> None:
        self.armed = False
        self.fly(0.1)

    @rule()
    def reboot(self) -> None:
        self.armed = False
        self.boot()
        self.staged = dict(self.committed or self.defaults)

    @rule(name=st.sampled_from(sorted(NAMES.values())), value=st.sampled_from(BAD))
    def a_coefficient_goes_bad_on_board(self, name: str, value: float) -> None:
        self.poison, self.shadow_s = {name: value}, 0.0

    @rule()
    def it_is_well_again(self) -> None:
        if self.poison:
            self.poison, self.shadow_s = {}, 0.0

    # What the vehicle does.

    @rule(mass=st.sampled_from(FIT), damping=st.sampled_from(FIT + UNFIT), then=st.sampled_from([2.0, 3.0]))
    def fly_a_whole_shadow(self, mass: float, damping: float, then: float) -> None:
        """What leads to a raise while armed, or to its refusal; other rules come between its parts anywhere else."""
        self.off_is_always_taken()
        self.stage_a_model(mass, damping)
        self.commit(True)
        self.ask_for_a_mode(1.0)
        self.arm()
        self.fly_long_enough()
        self.ask_for_a_mode(then)
        self.fly(1.0)

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

    @rule(speed=st.sampled_from([0.8, -0.8, math.nan, math.inf]))
    def fly_by_a_reference_that_jumps(self, speed: float) -> None:
        for _ in range(5):
            self.tick(jump=speed)

    @rule(velocity=st.sampled_from([math.nan, math.inf]))
    def fly_by_a_velocity_that_is_none(self, velocity: float) -> None:
        for _ in range(5):
            self.tick(velocity=velocity)

    def tick(self, age_s: float = math.nan, jump: float | None = None, velocity: float | None = None) -> None:
        self.now_s += TICK_S
        phase = 1.0 * self.now_s
        u, du = (0.2 - 0.2 * math.cos(phase), 0.2 * math.sin(phase)) if jump is None else (jump, 0.0)
        still = (0.0, 0.0, 0.0, 0.0)
        reference = Reference((u, 0, 0, 0, 0, 0), (du, 0, 0, 0, 0, 0), 0.0, 0.7, time_s=self.now_s - age_s)
        known = Navigation(
            (self.u if velocity is None else velocity, *still[:2]),
            self.now_s,
            still[:3],
            self.now_s,
            (1.0, *still[:3]),
            0.0,
            self.now_s,
            0.6,
            self.now_s,
        )
        self.pilot.mode = Mode(self.server.mode)
        told = (self.pilot.step if self.armed else self.pilot.rest)(self.now_s, known, reference)
        self.u += TICK_S * (told.tau_cmd[0] - TRUE["D_u"] * self.u) / TRUE["M_u"]
        stale = abs(age_s) > REFERENCE_STALE_S
        self.judge(told, stale or not math.isfinite(u))
        shadowed = self.armed and self.mode is Mode.SHADOW
        if shadowed and age_s != age_s and velocity is None and self.committed:
            self.shadow_s += TICK_S
        elif not (self.armed and self.mode.applies_feedforward):
            self.shadow_s = 0.0

    def judge(self, told, silent: bool) -> None:  # type: ignore[no-untyped-def]
        """What holds for every tick."""
        model = self.flown
        before, self.applied = (
            self.applied,
            tuple(told.tau_cmd[d] - told.tau_pid[d] for d in FEEDFORWARD_DOFS),
        )
        # Where all thrusters are scaled down together heave tells so, which the feed-forward has no part in.
        scaled, self.scaled = self.scaled, abs(told.tau_cmd[2] - told.tau_pid[2]) > 1e-6
        for axis, (dof, mass, damping) in enumerate(
            ((0, "M_u", "D_u"), (1, "M_v", "D_v"), (5, "I_r", "D_r"))
        ):
            assert abs(told.tau_ff[dof]) <= REACH[dof]
            sound = all(0 < model.get(name, -1.0) < 1e6 for name in (mass, damping))
            if not sound or silent:
                assert told.tau_ff[dof] == 0.0 or (dof != 0 and sound)
            acts = self.armed and self.mode.applies_feedforward and sound and not (silent and dof == 0)
            if not acts:
                assert self.scaled or abs(self.applied[axis]) <= 1e-6
            elif not (scaled or self.scaled):
                assert abs(self.applied[axis]) <= REACH[dof] + 1e-6
                assert abs(self.applied[axis] - before[axis]) <= SLOPE_PER_S * TICK_S * REACH[dof] + 1e-6

    @invariant()
    def what_is_in_force_is_one_committed_set_whole(self) -> None:
        assert self.server.mode == self.mode
        assert self.server.active_crc == (set_crc(self.committed) if self.committed else 0)
        held = self.committed or {}
        assert (
            self.server.active(VEH_CFG).items()
            >= {own: held[name] for name, own in NAMES.items() if held.get(name)}.items()
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
            deadline=None,
            suppress_health_check=checks,
        ),
    )


@pytest.mark.slow
def test_no_order_of_events_breaks_what_is_promised_of_the_modes() -> None:
    run(12, 30, True)


@pytest.mark.soak
def test_no_order_of_a_hundred_thousand_events_breaks_what_is_promised_of_the_modes() -> None:
    run(1000, 100, False)
