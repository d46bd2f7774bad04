"""The applet's Lua against the law in Python: the same pulses, to the microsecond."""

from dataclasses import replace

import numpy as np
import pytest
from fakes.ardusub import ALT_HOLD, MANUAL, POSHOLD, TICK_S, Ardusub

from bridge.ardusub.applet import applet
from bridge.ardusub.hold import VelocityHold
from bridge.ardusub.law import StickLaw
from bridge.ardusub.mixing import LEAST_SHARE, Mixer
from bridge.vehicle.accepted_effects import known_effects
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS, Lead, Onset, Slope, feedforward
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.parameters import set_crc, to_float32, vehicle_table
from bridge.vehicle.references import ZERO6, Reference
from bridge.vehicle.shadow import BLOCK_S, WINDOW_S
from bridge.vehicle.thrusters import Allocator, Pulses, thrust_curve

AXES = list(FEEDFORWARD_DOFS)
AHEAD_S, ADDED_SHARE = 0.03, 0.2


def wired(made, thrusters=6):
    """In the fail-safe wiring, with scripting on."""
    made.parameters["SCR_ENABLE"] = 1.0
    for n in range(1, thrusters + 1):
        made.parameters[f"SERVO{8 + n}_FUNCTION"] = 32.0 + n
    return made


class Rig:
    """The script of a vehicle file in the fake, with a set in force, in a mode, armed and flown by sticks."""

    def __init__(self, name="bluerov2", more=None, mode=Mode.ALONE, commits=True, frozen=False):
        self.file = load_vehicle(name)
        self.configuration = next(iter(self.file.vehicle.configurations))
        self.shape = self.file.vehicle.configurations[self.configuration]
        self.fake = wired(Ardusub())
        self.fake.quirks.checks_pilot = False
        made = applet(self.file, self.configuration, self.fake.parameters)
        self.fake.scripting.files["scripts/seatrial.lua"] = made.text.encode()
        self.fake.scripting.ends_overrides = not frozen
        self.fake.scripting.boot(0.0)
        self.fake.run(0.8)
        (self.script,) = self.fake.scripting.scripts
        self.set(more or {})
        if commits:
            self.commit()
            self.order(mode)
        self.fake.mode, self.fake.armed = MANUAL, True

    @property
    def values(self):
        return {name: value for name, value in self.fake.parameters.items() if name.startswith("FF0_")}

    @property
    def coefficients(self):
        return {
            name: self.values[f"FF0_{name.upper()}"]
            for name in self.names
            if self.values[f"FF0_{name.upper()}"]
        }

    @property
    def names(self):
        return [row.coefficient for row in vehicle_table(self.file.vehicle)]

    def set(self, more):
        for name, value in more.items():
            self.fake.parameters[f"FF0_{name.upper()}"] = to_float32(value)

    def commit(self):
        self.fake.parameters["FF_COMMIT"] = float(set_crc(self.values))
        self.fake.run(0.3)

    def order(self, mode):
        self.fake.parameters["FF_MODE"] = float(mode)
        self.fake.run(TICK_S)

    def tick(self, sticks):
        """A step with these sticks (x, y, r); the pulses of the thrusters' outputs."""
        x, y, r = sticks
        self.fake.sticks = (int(x), int(y), 500, int(r))
        self.fake.run(TICK_S)
        assert self.fake.scripting.scripts, self.fake.texts
        return np.array(self.fake.pwm[8:14])

    def said(self, words):
        return [text for text in self.fake.texts if words in text]


class Twin:
    """What the law in Python makes of the same sticks: pulses of the four horizontal thrusters."""

    def __init__(self, rig):
        vehicle, folder = rig.file.vehicle, rig.file.path.parent
        curve = thrust_curve(vehicle.thrust_curve, folder)
        self.mixer = Mixer(1, (1.0,) * 6, rig.shape, curve)
        coefficients = rig.coefficients
        self.law = StickLaw(vehicle, rig.configuration, lambda _: coefficients, folder, self.mixer)
        still = Reference(ZERO6, ZERO6, 0.0, 0.0)
        hull = known_effects(coefficients, rig.shape).hull
        self.lacking = feedforward(coefficients, still, (1e9,) * 6, hull).off
        self.reach = tuple(Allocator(rig.shape, curve).reach())
        self.lead = Lead(vehicle.thrust_curve.lag_s + AHEAD_S + TICK_S / 2, self.reach)
        self.hold = VelocityHold(rig.shape, self.reach)
        self.slope, self.onset = Slope(self.reach), Onset()
        self.limit_n = min(rig.shape.thruster_limit_n, curve.max_n, -curve.min_n)
        self.curve, self.pulses = curve, Pulses(curve, LEAST_SHARE * self.limit_n)
        self.time_s = rig.fake.clock.now_s
        # From rest, as the script is before it is armed.
        self.law.step(self.time_s, np.zeros(3), 0.5, Mode.SHADOW, "", MANUAL, Navigation(), ())

    def tick(self, now_s, sticks, mode, flight_mode, velocity, turn):
        navigation = Navigation(velocity, now_s, (0.0, 0.0, turn), now_s)
        gain = 0.5
        # ArduSub has the sticks as whole microseconds.
        inputs = (np.floor(1500 + 0.4 * gain * np.array(sticks, dtype=float)) - 1500) / 400
        _, made = self.law.step(now_s, inputs * 1000 / gain, gain, mode, "", flight_mode, navigation, ())
        flown = 3 if flight_mode == MANUAL else 2
        off = {dof for dof in range(6) if dof not in AXES[:flown]} | set(self.lacking)
        dt_s = now_s - self.time_s
        self.time_s = now_s
        wanted = np.array(self.lead.step(made.tau_ff, dt_s))
        if mode is Mode.BOTH:
            nu = tuple(np.array(made.reference.nu) + AHEAD_S * np.array(made.reference.nu_dot))
            pilot = np.zeros(6)
            pilot[AXES] = self.mixer.wrench(inputs)
            wanted += self.hold.step(navigation, replace(made.reference, nu=nu), pilot, off, dt_s)
        fed = np.array(self.slope.step(tuple(wanted), off, dt_s))
        self.onset.step(mode.applies_feedforward, dt_s)
        most = ADDED_SHARE * np.array(self.reach)[AXES]
        added = self.onset.share * np.clip(fed[AXES] - self.mixer.wrench(inputs), -most, most)
        added[[dof in off for dof in AXES]] = 0.0
        factors = np.array([row for _, row in self.mixer.driven])
        outputs = factors @ inputs
        mirror = np.round(1500 + 400 * outputs / max(1.0, np.abs(outputs).max()))
        if not added.any():
            return mirror
        base = self.curve.thrust(mirror)
        thrust = np.clip(
            base + self.mixer.inverse @ added, np.minimum(base, -self.limit_n), np.maximum(base, self.limit_n)
        )
        return np.floor(np.clip(self.pulses(thrust), 1100, 1900) + 0.5)


def sticks_of(seed, count):
    """Sticks that jump and hold, within the mixer's reach and beyond it."""
    rng = np.random.default_rng(seed)
    rows = []
    while len(rows) < count:
        rows += [rng.integers(-900, 901, 3) * rng.integers(0, 2, 3)] * int(rng.integers(1, 60))
    return rows[:count]


EFFECTS = {"Y_r": 2.0, "N_v": -1.5, "Y_uv": 3.0, "N_uv": 1.0, "N_munk": -4.0, "S_x": 0.3, "S_y": -0.2}


@pytest.mark.parametrize(
    ("name", "more", "mode", "flight_mode"),
    [
        ("bluerov2", {}, Mode.ALONE, MANUAL),
        ("bluerov2", EFFECTS, Mode.BOTH, MANUAL),
        ("bluerov2", {"X_uu": 0.0}, Mode.BOTH, ALT_HOLD),
        ("bluerov2", {"M_v": 0.0}, Mode.ALONE, ALT_HOLD),
        ("ardusub_vectored", {"M_u": 12.0, "X_uu": 48.0, "D_u": 0.1}, Mode.ALONE, MANUAL),
    ],
)
def test_the_script_gives_the_pulses_of_the_law_in_python(name, more, mode, flight_mode):
    rig = Rig(name, more, mode)
    rig.fake.mode = flight_mode
    twin, rng = Twin(rig), np.random.default_rng(7)
    off, added = [], 0
    for sticks in sticks_of(3, 600):
        velocity = tuple(float(v) for v in rng.uniform(-0.5, 0.5, 3))
        turn = float(rng.uniform(-0.5, 0.5))
        rig.fake.scripting.velocity_m_s, rig.fake.scripting.turn_rad_s = velocity, turn
        seen = rig.tick(sticks)
        off.append(seen[:4] - twin.tick(rig.fake.clock.now_s, sticks, mode, flight_mode, velocity, turn))
        added += any(n in rig.fake.scripting.overrides for n in range(8, 14))
        assert list(seen[4:]) == rig.fake.mixed()[4:6]
    assert added > 400
    assert not np.abs(off).max()


def test_its_checksum_of_a_set_is_the_vehicles():
    rig = Rig(more={"T3_gain": 0.875, "Y_r": -1e-3})
    assert rig.fake.parameters["FF_ACTIVE"] == set_crc(rig.values)
    assert rig.said(f"F5:{set_crc(rig.values)}")


@pytest.mark.parametrize("mode", [Mode.OFF, Mode.SHADOW])
def test_nothing_is_added_where_the_feedforward_does_not_act(mode):
    rig = Rig(mode=mode)
    for sticks in sticks_of(5, 200):
        assert list(rig.tick(sticks)) == rig.fake.mixed()[:6]


def acting(**options):
    """A rig that adds something just now."""
    rig = Rig(**options)
    for _ in range(10):
        rig.tick((600, 0, 0))
    assert differs(rig)
    return rig


def differs(rig):
    return rig.fake.pwm[8:14] != rig.fake.mixed()[:6]


def test_off_takes_everything_back_in_the_same_tick():
    rig = acting()
    rig.fake.parameters["FF_MODE"] = 0.0
    assert list(rig.tick((600, 0, 0))) == rig.fake.mixed()[:6]


def disarmed(rig):
    rig.fake.armed = False


def held(rig):
    rig.fake.mode = POSHOLD


def gone(rig):
    rig.fake.parameters["SERVO1_FUNCTION"] = 0.0
    rig.fake.parameters["SERVO9_FUNCTION"] = 0.0


@pytest.mark.parametrize("change", [disarmed, held, gone])
def test_disarmed_held_by_itself_or_without_a_motor_the_mixer_alone_drives(change):
    rig = acting()
    change(rig)
    for _ in range(1 if change is not gone else 6):
        rig.tick((600, 0, 0))
    assert rig.fake.pwm[8:14] == rig.fake.mixed()[8:14]


@pytest.mark.parametrize("output", [1, 9, 12])
def test_where_an_output_is_wired_anew_it_is_off_at_once_and_refuses_to_act(output):
    """As by a crew that has gone back to outputs 1 to 6, and has hung its lights on the upper ones."""
    rig = acting()
    rig.fake.parameters[f"SERVO{output}_FUNCTION"] = 59.0
    rig.tick((600, 0, 0))
    assert rig.fake.parameters["FF_MODE"] == Mode.OFF
    rig.tick((600, 0, 0))
    assert rig.fake.pwm == rig.fake.mixed()
    motor = output if output < 9 else output - 8
    assert rig.said(f"FF off: SERVO{output}_FUNCTION is 59, not {32 + motor}")
    rig.order(Mode.BOTH)
    assert rig.fake.parameters["FF_MODE"] == Mode.OFF
    assert rig.said(f"FF_MODE refused: SERVO{output}_FUNCTION is 59")
    rig.order(Mode.SHADOW)
    assert rig.fake.parameters["FF_MODE"] == Mode.SHADOW


def test_a_script_that_starts_on_outputs_wired_anew_sends_them_no_pulse_of_its_proof():
    rig = Rig()
    rig.fake.armed = False
    rig.fake.parameters["SERVO1_FUNCTION"] = 59.0
    rig.fake.scripting.boot(rig.fake.clock.now_s)
    seen = set()
    for _ in range(100):
        rig.fake.run(TICK_S)
        seen |= {tuple(rig.fake.scripting.overrides)}
    assert rig.fake.scripting.scripts, rig.fake.texts
    assert seen == {()}


def test_a_script_that_stops_leaves_the_mixers_output_50_ms_later():
    rig = acting()
    rig.fake.scripting.stop()
    began_s = rig.fake.clock.now_s
    assert rig.fake.until(lambda: not differs(rig), 1.0)
    assert rig.fake.clock.now_s - began_s <= 0.05 + 1e-9


def test_where_overrides_never_end_it_adds_nothing_and_refuses_to():
    rig = Rig(frozen=True)
    assert rig.said("keeps overrides for ever")
    assert rig.said("outputs would freeze")
    assert rig.fake.parameters["FF_MODE"] == Mode.OFF
    for sticks in sticks_of(5, 100):
        assert list(rig.tick(sticks)[:6]) == rig.fake.mixed()[8:14]


def test_after_an_update_to_such_a_firmware_the_stored_mode_is_taken_back():
    rig = Rig()
    rig.fake.armed = False
    rig.fake.scripting.ends_overrides = False
    rig.fake.scripting.boot(rig.fake.clock.now_s)
    rig.fake.run(1.0)
    assert rig.fake.parameters["FF_MODE"] == Mode.OFF


def test_a_script_that_starts_armed_adds_nothing_until_it_could_prove_itself():
    rig = Rig()
    rig.fake.scripting.restart(rig.fake.clock.now_s)
    for _ in range(100):
        assert list(rig.tick((600, 0, 0))) == rig.fake.mixed()[:6]


def test_a_script_that_fails_says_why_and_leaves_the_mixers_output():
    rig = acting()
    rig.fake.parameters["FF0_M_U"] = None
    rig.fake.parameters["FF_COMMIT"] = 5.0
    rig.fake.run(0.2)
    assert not rig.fake.scripting.scripts
    assert rig.said("attempt to")
    assert not differs(rig)


def test_what_it_adds_grows_no_faster_than_the_slope_and_stays_within_its_share():
    rig = Rig(more={"M_u": 300.0})
    twin = Twin(rig)
    before = np.zeros(3)
    for sticks in [(0, 0, 0)] * 3 + [(900, 0, 0)] * 20 + [(-900, 0, 0)] * 40:
        pulses = rig.tick(sticks)[:4]
        total = twin.mixer.matrix @ twin.curve.thrust(pulses)
        pilot = twin.mixer.matrix @ twin.curve.thrust(np.array(rig.fake.mixed()[:4]))
        assert abs(total[0] - pilot[0]) <= 0.6 * twin.reach[0] + 1.0
        # From the pilot's own thrust and the thrust before, no further than a tick of the slope; a pulse is 0.3 N.
        low, high = min(before[0], pilot[0]), max(before[0], pilot[0])
        assert low - 0.02 * twin.reach[0] - 1.5 <= total[0] <= high + 0.02 * twin.reach[0] + 1.5
        before = total


def fly_in_shadow(rig, model, seconds):
    """A vehicle that moves as `model` says, in surge, by the sticks: each 3 s another."""
    twin, u = Twin(rig), 0.0
    for number in range(round(seconds / TICK_S)):
        x = (400, 0, -400, 200)[number // 300 % 4]
        pulses = rig.tick((x, 0, 0))[:4]
        force = (twin.mixer.matrix @ twin.curve.thrust(pulses))[0]
        u += TICK_S * (force - model["D_u"] * u - model["X_uu"] * abs(u) * u) / model["M_u"]
        rig.fake.scripting.velocity_m_s = (u, 0.0, 0.0)


TRUE = {"M_u": 17.0, "D_u": 4.03, "X_uu": 18.18}


def test_armed_the_mode_is_raised_once_a_minute_in_shadow_was_good():
    rig = Rig(mode=Mode.SHADOW)
    rig.order(Mode.ALONE)
    assert rig.fake.parameters["FF_MODE"] == Mode.SHADOW
    assert rig.said("F2 ")
    fly_in_shadow(rig, TRUE, WINDOW_S - BLOCK_S)
    rig.order(Mode.ALONE)
    assert rig.fake.parameters["FF_MODE"] == Mode.SHADOW
    assert rig.said("F3 shadow: 5")
    fly_in_shadow(rig, TRUE, 3 * BLOCK_S)
    rig.order(Mode.ALONE)
    assert rig.fake.parameters["FF_MODE"] == Mode.ALONE


def test_it_is_not_raised_where_the_model_explains_too_little_of_the_force():
    rig = Rig(mode=Mode.SHADOW, more={name: 0.4 * value for name, value in TRUE.items()})
    fly_in_shadow(rig, TRUE, WINDOW_S + 2 * BLOCK_S)
    rig.order(Mode.BOTH)
    assert rig.fake.parameters["FF_MODE"] == Mode.SHADOW
    assert rig.said("of surge explained")


def another_set(rig):
    rig.set({"M_u": 17.5})
    rig.commit()
    assert rig.fake.parameters["FF_ACTIVE"] == set_crc(rig.values)


def a_rest_disarmed(rig):
    rig.fake.armed = False
    rig.fake.run(TICK_S)
    rig.fake.armed = True


def no_velocity(rig):
    rig.fake.scripting.knows_velocity = False
    rig.fake.run(TICK_S)
    rig.fake.scripting.knows_velocity = True


@pytest.mark.parametrize("event", [another_set, a_rest_disarmed, no_velocity])
def test_the_minute_begins_anew(event):
    rig = Rig(mode=Mode.SHADOW)
    fly_in_shadow(rig, TRUE, WINDOW_S + 2 * BLOCK_S)
    event(rig)
    rig.order(Mode.ALONE)
    assert rig.fake.parameters["FF_MODE"] == Mode.SHADOW


def test_what_was_flown_in_shadow_before_it_was_disarmed_in_both_does_not_let_it_fly_alone():
    rig = Rig(mode=Mode.SHADOW)
    fly_in_shadow(rig, TRUE, WINDOW_S + 2 * BLOCK_S)
    rig.order(Mode.BOTH)
    assert rig.fake.parameters["FF_MODE"] == Mode.BOTH
    a_rest_disarmed(rig)
    rig.order(Mode.ALONE)
    assert rig.fake.parameters["FF_MODE"] == Mode.BOTH


def test_a_mode_that_is_none_is_put_back():
    rig = Rig(mode=Mode.SHADOW)
    rig.order(7)
    assert rig.fake.parameters["FF_MODE"] == Mode.SHADOW


@pytest.mark.parametrize("name", ["M_u", "T3_gain"])
def test_a_set_out_of_its_bounds_is_not_taken(name):
    rig = Rig()
    before = rig.fake.parameters["FF_ACTIVE"]
    rig.fake.armed = False
    rig.set({name: 9000.0})
    rig.commit()
    assert rig.fake.parameters["FF_ACTIVE"] == rig.fake.parameters["FF_COMMIT"] == before
    assert rig.said("out of bounds")


def test_under_way_with_the_feedforward_no_set_is_taken():
    rig = acting()
    before = rig.fake.parameters["FF_ACTIVE"]
    rig.set({"M_u": 18.0})
    rig.commit()
    assert rig.fake.parameters["FF_ACTIVE"] == before
    assert rig.said("force FF off first")


def test_the_set_and_the_mode_are_there_again_after_a_reboot_but_not_a_half_written_set():
    rig = Rig(mode=Mode.BOTH)
    active = rig.fake.parameters["FF_ACTIVE"]
    rig.fake.armed = False
    rig.fake.scripting.boot(rig.fake.clock.now_s)
    rig.fake.run(0.5)
    assert (rig.fake.parameters["FF_ACTIVE"], rig.fake.parameters["FF_MODE"]) == (active, Mode.BOTH)
    assert rig.said("FF acts once armed")
    rig.set({"M_u": 18.0})
    rig.fake.scripting.boot(rig.fake.clock.now_s)
    rig.fake.run(0.5)
    assert (rig.fake.parameters["FF_ACTIVE"], rig.fake.parameters["FF_MODE"]) == (0.0, Mode.OFF)


def test_a_set_of_another_hull_is_not_in_force():
    rig = Rig()
    rig.fake.parameters["FF_HULL"] += 1
    rig.fake.scripting.boot(rig.fake.clock.now_s)
    rig.fake.run(0.5)
    assert rig.fake.parameters["FF_ACTIVE"] == 0.0


def test_what_only_the_script_may_write_is_put_back():
    rig = Rig()
    before = dict(rig.fake.parameters)
    for name in ("FF_ACTIVE", "FF_VERSION", "FF_APPLET"):
        rig.fake.parameters[name] = 4.0
    rig.fake.run(0.5)
    assert rig.fake.parameters == before


def test_a_velocity_far_off_the_reference_is_told_once_and_again_after_it_was_silent():
    rig = Rig(mode=Mode.BOTH)
    for velocity_m_s, times in ((2.0, 1), (float("nan"), 1), (2.0, 2)):
        rig.fake.scripting.velocity_m_s = (velocity_m_s, 0.0, 0.0)
        for _ in range(20):
            rig.tick((0, 0, 0))
        assert len(rig.said("FF surge not held: velocity off by over 0.5 m/s")) == times
