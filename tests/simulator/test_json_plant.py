"""The body of ArduSub's own simulator: bytes in, bytes out, against exact answers."""

import contextlib
import json
import math
import socket
import struct
from dataclasses import replace
from threading import Event, Thread

import numpy as np
import pytest
from fakes.ports import free_port

from bridge.simulator.json_plant import json_body, serve
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.thrusters import thrust_curve

BUOYANT = load_vehicle("bluerov2")
# Neutral, it keeps level: what rises under way is turned nose up by its Munk moment.
SHAPE = replace(BUOYANT.vehicle.configurations["standard"], net_buoyancy_n=0.0)
FILE = replace(BUOYANT, vehicle=replace(BUOYANT.vehicle, configurations={"standard": SHAPE}))
STILL = load_truth(FILE, "standard").calm()
NEUTRAL = (1500,) * 6


class Autopilot:
    """The autopilot's side: a packet for each step."""

    def __init__(self, planted=None, **options):
        truth = replace(STILL, onset=planted or {})
        self.body = json_body(FILE, "standard", truth, **{"depth_m": 5.0, **options})
        self.count = 0

    def packet(self, pwm):
        return struct.pack("<HHI16H", 18458, 400, self.count, *pwm, *(0,) * (16 - len(pwm)))

    def step(self, pwm=NEUTRAL, times=1):
        for _ in range(times):
            self.count += 1
            self.raw = self.body.answer(self.packet(pwm))
        return json.loads(self.raw)


def steady_surge_m_s(pwm_us):
    """At the speed where thrust equals drag, by the vehicle file's own figures."""
    curve = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
    ahead, astern = float(curve.thrust(pwm_us)), float(curve.thrust(3000 - pwm_us))
    force = 0.70711 * (2 * ahead - 2 * astern)
    linear, quadratic = 4.03, 18.18
    return (math.sqrt(linear**2 + 4 * quadratic * force) - linear) / (2 * quadratic)


SURGE = (1400, 1400, 1600, 1600, 1500, 1500)


def test_the_answer_is_compact_json_between_line_ends():
    autopilot = Autopilot()
    autopilot.step()
    assert autopilot.raw.startswith(b"\n{")
    assert autopilot.raw.endswith(b"}\n")
    assert b" " not in autopilot.raw


def test_at_rest_it_feels_gravity_upwards_at_its_depth():
    state = Autopilot().step()
    assert state["timestamp"] == 1 / 400
    assert state["imu"]["accel_body"][2] == pytest.approx(-9.80665, abs=1e-9)
    assert state["position"][2] == pytest.approx(5.0, abs=1e-5)


def test_held_pulses_end_in_the_closed_form_speed():
    autopilot = Autopilot()
    north, east, _ = autopilot.step(SURGE, 1600)["velocity"]
    assert north == pytest.approx(steady_surge_m_s(1600), rel=2e-3)
    assert east == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(autopilot.body.state[7:9], (north, east), atol=1e-6)


def test_without_thrust_it_ends_drifting_over_the_ground_with_the_current_and_feels_nothing_of_it():
    state = Autopilot({"current_n": 0.3}).step(times=10_000)
    assert state["velocity"][0] == pytest.approx(0.3, abs=1e-3)
    assert state["imu"]["accel_body"][0] == pytest.approx(0.0, abs=1e-3)


def test_a_packet_that_is_sent_again_is_answered_again_and_moves_nothing():
    autopilot = Autopilot()
    autopilot.step(SURGE, 10)
    before = autopilot.body.time_s
    assert autopilot.body.answer(autopilot.packet(SURGE)) == autopilot.raw
    assert autopilot.body.time_s == before


def packet_of(autopilot, count):
    autopilot.count = count
    return autopilot.packet(NEUTRAL)


def test_packets_that_were_sent_again_meanwhile_get_one_answer_together():
    """A second answer would pass for the state after the next packet: from then on every pulse would act late."""
    autopilot, stop, stepped, port = Autopilot(), Event(), Event(), free_port(socket.SOCK_DGRAM)
    first, second, third = (packet_of(autopilot, count) for count in (1, 2, 3))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
        here.connect(("127.0.0.1", port))
        here.settimeout(5.0)
        answers = []

        def each():
            """The body's computer is busy after the first step: the autopilot asks for the second again and again."""
            if not answers:
                answers.append(here.recv(1024))
                for _ in range(5):
                    here.send(second)
                stepped.set()

        serving = Thread(target=serve, args=(autopilot.body, port, stop, each), daemon=True)
        serving.start()
        while not stepped.wait(0.05):
            with contextlib.suppress(ConnectionRefusedError):
                here.send(first)
        answers.append(here.recv(1024))
        here.send(third)
        answers.append(here.recv(1024))
        stop.set()
        serving.join()
    assert [round(json.loads(raw)["timestamp"] * 400) for raw in answers] == [1, 2, 3]


def test_an_autopilot_that_rebooted_gets_a_time_that_starts_again_and_a_body_that_moves_on():
    autopilot = Autopilot()
    fast = autopilot.step(SURGE, 400)["velocity"][0]
    autopilot.count = 0
    state = autopilot.step(SURGE)
    assert state["timestamp"] == pytest.approx(1 / 400)
    assert state["velocity"][0] > 0.99 * fast


def test_thrusters_hang_on_the_outputs_they_are_said_to_hang_on():
    """The fail-safe wiring: the mixer mirrored on 1 to 6, thrusters on 9 to 14."""
    autopilot = Autopilot(first_output=9)
    assert autopilot.step((*SURGE, 1500, 1500, *NEUTRAL), 200)["velocity"][0] == pytest.approx(0.0, abs=1e-9)
    assert autopilot.step((*NEUTRAL, 1500, 1500, *SURGE), 200)["velocity"][0] > 0.1


def test_an_output_that_is_switched_off_is_a_thruster_at_rest():
    assert Autopilot().step((0,) * 6, 200)["velocity"][0] == pytest.approx(0.0, abs=1e-9)


def test_a_dead_time_holds_the_thrust_back_that_long():
    autopilot = Autopilot({"delay": 0.15})
    assert autopilot.step(SURGE, 60)["velocity"][0] == pytest.approx(0.0, abs=1e-12)
    assert autopilot.step(SURGE, 1)["velocity"][0] > 1e-6


@pytest.mark.parametrize("packet", [b"", b"\0" * 40, b"\x48\x1a" * 20])
def test_what_is_no_packet_of_ardusubs_is_not_answered(packet):
    assert Autopilot().body.answer(packet) is None
