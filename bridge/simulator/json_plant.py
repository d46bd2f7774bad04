"""The simulated body as the physics of ArduSub's own simulator, `ardusub --model JSON:127.0.0.1`, over UDP.

ArduSub sends the pulses of its 16 outputs and waits for the state that follows from them, a step later: it
keeps the time, so that both run in lock-step. It reads compact JSON alone: a space after a comma or a colon is a
parse error (measured, 4.5).
"""

import json
import math
import select
import socket
import struct
import time
from collections.abc import Callable
from threading import Event
from typing import Any, Final

import numpy as np

from bridge.arrays import Array
from bridge.attitude import angles_of, body_to_earth
from bridge.errors import LinkError
from bridge.links.addresses import LOOPBACK, no_listener
from bridge.simulator.plant import Motion, Plant, Stretch
from bridge.simulator.truth import Truth
from bridge.vehicle.config import GRAVITY_M_S2, VehicleFile
from bridge.vehicle.thrusters import NEUTRAL_US, thrust_curve

STEP_HZ: Final = 400.0
"""The rate of ArduSub's main loop."""
FOR_SCRIPTS_HZ: Final = 800.0
"""Steps a second where ArduSub runs scripts.

At the end of a loop its simulator waits for a step, to move its clock on, and holds its main lock meanwhile
(`AP_Scheduler::loop`). Of steps as long as the loop that is nearly all the time that there is, and a script that asks
for the flight mode waits for that lock, for a second and more (measured, 4.5.7). An autopilot's board has no such wait.
"""
PORT: Final = 9002
"""Where the first instance of ArduSub's simulator sends; each further instance sends 10 higher."""

_SERVOS: Final = struct.Struct("<HHI16H")
_MAGIC: Final = 18458
_LOWEST_US: Final = 800
"""A lower pulse is an output that is switched off; its speed controller rests."""
_WAIT_S: Final = 0.2
_LOST_S: Final = 0.05
"""An answer that was sent so long ago, and is asked for again, was lost."""
_ORIGIN: Final = np.zeros(3)


class JsonBody:
    """Answers ArduSub's packets with the motion of `plant`, which must take `step_hz` steps a second.

    `first_output`: the output, from 1, that drives the first thruster; the others follow. `tell` gets each step's
    motion.
    """

    def __init__(
        self,
        plant: Plant,
        thrusters: int,
        *,
        first_output: int = 1,
        step_hz: float = STEP_HZ,
        tell: Callable[[Stretch], None] = lambda _: None,
    ) -> None:
        self._plant, self.step_hz, self._tell = plant, step_hz, tell
        self._outputs = slice(first_output - 1, first_output - 1 + thrusters)
        self._count = -1
        self._begun_s = 0.0
        self._answer = b""

    @property
    def state(self) -> Array:
        """North east down (m), attitude w x y z, velocity over the ground in body axes and rates of turn."""
        return self._plant.state

    @property
    def time_s(self) -> float:
        return self._plant.time_s

    def answer(self, packet: bytes) -> bytes | None:
        """Advance by a step and return the state as JSON; None for no packet of ArduSub's.

        A packet that is sent again gets the same answer again. One that counts from the start comes from an
        autopilot that rebooted: its time starts again, the body moves on.
        """
        if len(packet) < _SERVOS.size:
            return None
        magic, _, count, *pwm = _SERVOS.unpack_from(packet)
        if magic != _MAGIC:
            return None
        if count != self._count or not self._answer:
            if count < self._count:
                self._begun_s = self._plant.time_s
            self._count = count
            self._answer = self._advance(pwm)
        return self._answer

    def _advance(self, pwm: list[int]) -> bytes:
        driven = tuple(float(us) if us >= _LOWEST_US else NEUTRAL_US for us in pwm[self._outputs])
        stretch = self._plant.advance(driven, 1 / self.step_hz)
        self._tell(stretch)
        state, nu_dot = stretch.state[-1], stretch.nu_dot[-1]
        motion = Motion(
            stretch.time_s[-1:], state[None, :3], state[None, 3:7], state[None, 7:10], state[None, 10:],
            nu_dot[None, :3], nu_dot[None, 3:],
        )  # fmt: skip
        rotation = body_to_earth(state[3:7])
        text = json.dumps(
            {
                "timestamp": round(self._plant.time_s - self._begun_s, 6),
                "imu": {
                    "gyro": state[10:].tolist(),
                    "accel_body": motion.specific_force_at(_ORIGIN, GRAVITY_M_S2)[0].tolist(),
                },
                "position": state[:3].tolist(),
                "attitude": angles_of(rotation),
                "velocity": (rotation @ state[7:10]).tolist(),
            },
            separators=(",", ":"),
        )
        return b"\n" + text.encode() + b"\n"


def json_body(
    file: VehicleFile,
    configuration: str,
    truth: Truth,
    *,
    seed: int = 0,
    depth_m: float = 0.0,
    first_output: int = 1,
    step_hz: float = STEP_HZ,
    tell: Callable[[Stretch], None] = lambda _: None,
) -> JsonBody:
    """The body of a vehicle file at rest; its thrust curve's lag and dead time count. Raises ConfigError."""
    shape, curve = file.vehicle.configurations[configuration], file.vehicle.thrust_curve
    plant = Plant(
        shape,
        thrust_curve(curve, file.path.parent),
        curve.lag_s,
        truth,
        np.random.default_rng(seed),
        depth_m=depth_m,
        rate_hz=step_hz,
        delay_s=curve.delay_s,
    )
    return JsonBody(plant, len(shape.thrusters), first_output=first_output, step_hz=step_hz, tell=tell)


def serve(body: JsonBody, port: int, stop: Event, each: Callable[[], None] = lambda: None) -> None:
    """Answer at `port` of this computer until `stop` is set; `each` runs after every step. Raises LinkError.

    While `each` runs, ArduSub sends its packet again and again. One answer to all of them is enough: it takes every
    further one for the state of a later step, and from then on its pulses would act so many steps late.
    """
    last, answered_s = b"", -math.inf
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
        try:
            here.bind((LOOPBACK, port))
        except OSError as error:
            raise no_listener(f"udpin:{LOOPBACK}:{port}", LOOPBACK, port, error) from None
        here.settimeout(_WAIT_S)
        while not stop.is_set():
            try:
                packet, sender = _newest(here)
            except TimeoutError:
                continue
            except OSError as error:
                raise LinkError(f"udpin:{LOOPBACK}:{port}: {error.strerror or error}") from None
            if packet == last and time.monotonic() - answered_s < _LOST_S:
                continue
            if (answer := body.answer(packet)) is not None:
                here.sendto(answer, sender)
                last, answered_s = packet, time.monotonic()
                each()


def _newest(here: socket.socket) -> tuple[bytes, Any]:
    """The newest packet that waits, and its sender. Raises TimeoutError where none comes."""
    newest = here.recvfrom(1024)
    while select.select([here], [], [], 0.0)[0]:
        newest = here.recvfrom(1024)
    return newest
