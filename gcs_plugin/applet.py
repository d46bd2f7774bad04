"""Puts the applet into an ArduSub by MAVLink alone, looks at it, and takes it out again.

    SCR_ENABLE 1 -> reboot -> the script by MAVLink FTP, proven by its CRC -> scripting restarted -> its beat and mark

A script that has stopped leaves its parameters behind, and the autopilot answers for them: that it runs is proven by
its own beat alone, the FF_MODE in its telemetry.
"""

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.ardusub.applet import APPLET, ENABLE, NAME, applet, wiring_fault
from bridge.clock import Clock
from bridge.errors import LinkError, LinkTimeout, ParamRejected, ParamUnverified
from bridge.firmware.ardusub import FRAME
from bridge.links.link import Link
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import ACTIVE, MODE
from bridge.wire import ftp
from gcs_plugin.asking import ANSWER_S, Asking, command_long
from gcs_plugin.params.client import ParameterClient
from gcs_plugin.params.proposal import propose_upload
from gcs_plugin.params.receipt import Receipt, newest
from gcs_plugin.params.wanted import Wanted
from gcs_plugin.peers import Source, ground_heartbeat

FOLDERS: Final = ("APM/scripts", "scripts")
"""Where ArduPilot looks for scripts, on boards with a card of their own and on others."""
UNDER_WAY: Final = "seatrial.new"
"""Name of a script that is not whole yet; scripting takes no notice of it."""
WRITE_BYTES: Final = 200
CREATE_TIMES: Final = 5
BOOT_S: Final = 60.0
DEAF_S: Final = 2.0
"""After an order to reboot: messages until then are of the run before."""
BEATS_WITHIN_S: Final = 10.0
ENDS: Final = "FF_ENDS"
"""Telemetry of the applet: 1 once it has proved that its overrides end by themselves, 0 if they do not."""
FREEZES: Final = (
    "this firmware keeps an override for ever, so a thruster would keep its last pulse where the script stops; the "
    "script adds nothing there: update ArduSub (4.5.7 lets go), or use the companion"
)
LOOK_S: Final = 2.5
"""The script beats twice a second."""
RESTART: Final = 3.0
"""SCRIPTING_CMD_STOP_AND_RESTART."""
_REBOOT: Final = dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN

NAN: Final = math.nan
Tell = Callable[[str], None]


@dataclass(frozen=True)
class State:
    """The applet as an autopilot has it.

    `fault` says why it may not run there, "" if it may; `folder` is that of the scripts, None while scripting is off;
    `there`: whether the installed script is the vehicle file's, None if none is installed; `runs`: a script sends
    heartbeats; `is_mine`: it is the vehicle file's. FF_MODE and FF_ACTIVE are NaN if none runs.
    """

    fault: str
    folder: str | None
    there: bool | None
    runs: bool
    is_mine: bool
    mode: float
    active: float

    @property
    def good(self) -> bool:
        """Whether the vehicle file's script is there, runs, and may run."""
        return not self.fault and self.there is True and self.is_mine


class Station(Asking):
    """Questions to an autopilot, its scripts and its file server."""

    def __init__(self, link: Link, clock: Clock, target: Source) -> None:
        super().__init__(link, clock, target)
        self._sequence = 0

    def order(self, number: int, *parameters: float) -> None:
        """Order a command. Raises ParamRejected if it is refused."""
        result = self.command(number, *parameters)
        if result not in (dialect.MAV_RESULT_ACCEPTED, dialect.MAV_RESULT_IN_PROGRESS):
            raise ParamRejected(f"the autopilot refuses command {number} (MAV_RESULT {result})")

    def reboot(self) -> None:
        """Reboot the autopilot, and wait until it is ready to be ordered about."""
        began_s = self._clock.boot_s()
        self.order(_REBOOT, 1.0)
        self.pause(DEAF_S)

        def ready(message: Any) -> bool | None:
            beats = message.get_type() == "HEARTBEAT" and message.system_status >= dialect.MAV_STATE_STANDBY
            return True if beats else None

        def anew(message: Any) -> bool | None:
            since_boot_s = getattr(message, "time_boot_ms", None)
            if since_boot_s is None:
                return None
            return True if since_boot_s * 1e-3 <= self._clock.boot_s() - began_s else None

        interval = dialect.MAV_CMD_SET_MESSAGE_INTERVAL
        time = dialect.MAVLINK_MSG_ID_SYSTEM_TIME
        ask = command_long(self._target, interval, float(time), 5e5)
        self.until(ready, BOOT_S, ground_heartbeat(), "the autopilot's start")
        self.until(anew, ANSWER_S, ask, "the clock of a new start")

    def armed(self) -> bool:
        """Whether the autopilot's next HEARTBEAT says that the vehicle is armed."""

        def beat(message: Any) -> bool | None:
            is_beat = message.get_type() == "HEARTBEAT"
            return bool(message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED) if is_beat else None

        return self.until(beat, ANSWER_S, ground_heartbeat(), "the autopilot's HEARTBEAT")

    def beating(self, seconds: float) -> bool:
        """Whether the applet beats within `seconds`."""
        return self._telemetry(MODE, seconds) is not None

    def lets_go(self, seconds: float) -> bool | None:
        """Whether the applet has proved that an override ends by itself; None where it has not tried yet."""
        proof = self._telemetry(ENDS, seconds)
        return None if proof is None else bool(proof)

    def _telemetry(self, name: str, seconds: float) -> float | None:
        """The value of that name in the applet's telemetry; None if it does not come within `seconds`."""

        def value(message: Any) -> float | None:
            mine = message.get_type() == "NAMED_VALUE_FLOAT" and message.name == name
            return float(message.value) if mine else None

        try:
            return self.until(value, seconds)
        except LinkTimeout:
            return None

    def ask_files(self, op: ftp.Op, data: bytes = b"", offset: int = 0) -> ftp.Packet:
        """The answer to a request for files, granted or not."""
        self._sequence = (self._sequence + 2) & 0xFFFF
        packet = ftp.Packet(self._sequence, 0, op, len(data), offset=offset, data=data)
        payload = list(packet.encode().ljust(ftp.PAYLOAD_BYTES, b"\0"))
        ask = dialect.MAVLink_file_transfer_protocol_message(0, *self._target, payload)

        def answered(message: Any) -> ftp.Packet | None:
            if message.get_type() != "FILE_TRANSFER_PROTOCOL":
                return None
            answer = ftp.decode(bytes(message.payload))
            right = answer.sequence == (packet.sequence + 1) & 0xFFFF and answer.request == op
            return answer if right else None

        return self.until(answered, ANSWER_S, ask, "the answer of its file server")

    def folder(self) -> str | None:
        for folder in FOLDERS:
            answer = self.ask_files(ftp.Op.LIST, folder.encode())
            if answer.op == ftp.Op.ACK or answer.data[:1] == bytes((ftp.Fault.END,)):
                return folder
        return None

    def crc32(self, path: str) -> int | None:
        """CRC-32 of a file as MAVLink FTP has it; None without the file."""
        answer = self.ask_files(ftp.Op.CRC32, path.encode())
        whole = answer.op == ftp.Op.ACK and len(answer.data) == 4
        return int(struct.unpack("<I", answer.data)[0]) if whole else None

    def put(self, folder: str, data: bytes) -> None:
        """Write the script, and give it its name once it was proven whole. Raises ParamUnverified."""
        under_way, final = f"{folder}/{UNDER_WAY}", f"{folder}/{NAME}"
        self._create(under_way)
        for offset in range(0, len(data), WRITE_BYTES):
            self._must(ftp.Op.WRITE, data[offset : offset + WRITE_BYTES], offset)
        self._must(ftp.Op.TERMINATE)
        if self.crc32(under_way) != ftp.crc32(data):
            self.ask_files(ftp.Op.REMOVE, under_way.encode())
            raise ParamUnverified(
                f"{final}: what arrived is not what was sent; nothing runs of it, try again"
            )
        self.ask_files(ftp.Op.REMOVE, final.encode())
        self.ask_files(ftp.Op.RENAME, under_way.encode() + b"\0" + final.encode())
        if self.crc32(final) != ftp.crc32(data):
            raise ParamUnverified(f"{final}: it could not be given its name; nothing runs of it, try again")

    def _create(self, path: str) -> None:
        """Open a new file; a second request, where the answer to the first was lost, is refused."""
        for _ in range(CREATE_TIMES - 1):
            self.ask_files(ftp.Op.RESET)
            if self.ask_files(ftp.Op.CREATE, path.encode()).op == ftp.Op.ACK:
                return
        self.ask_files(ftp.Op.RESET)
        self._must(ftp.Op.CREATE, path.encode())

    def _must(self, op: ftp.Op, data: bytes = b"", offset: int = 0) -> None:
        answer = self.ask_files(op, data, offset)
        if answer.op != ftp.Op.ACK:
            why = answer.data[0] if answer.data else 0
            raise ParamRejected(
                f"the autopilot's file server refuses {op.name} (error {why}); check its card"
            )


class Deployment:
    """The applet of a vehicle file and the autopilot on `link`, which has to come back by itself after a reboot.

    `fault` says why the applet may not run there, "" if it may. Raises LinkError if no ArduSub, or a companion,
    beats there; ConfigError for a vehicle file that does not fit the autopilot's frame.
    """

    def __init__(
        self, link: Link, clock: Clock, file: VehicleFile, configuration: str, system: int | None = None
    ) -> None:
        self._clock = clock
        self.client = ParameterClient(link, clock)
        self.target = self.client.find_vehicle(system=system)
        if self.target[1] != dialect.MAV_COMP_ID_AUTOPILOT1:
            raise LinkError(
                f"vehicle {self.target[0]}: its companion, component {self.target[1]}, holds a feed-forward, and an "
                "applet would add its own to it: end the companion first, or stay with it"
            )
        self._station = Station(link, clock, self.target)
        self.present = self.client.read_all()
        if FRAME not in self.present:
            raise LinkError(f"vehicle {self.target[0]} has no {FRAME}: an applet runs in ArduSub alone")
        self.fault = wiring_fault(self.present, len(file.vehicle.configurations[configuration].thrusters))
        self._made = None if self.fault else applet(file, configuration, self.present)

    def look(self) -> State:
        """The present state; sends no write."""
        # Read anew: `deploy` may have enabled scripting since all parameters were read.
        enabled = ENABLE in self.present and self._station.read(ENABLE) == 1
        folder = self._station.folder() if enabled else None
        crc = None if folder is None else self._station.crc32(f"{folder}/{NAME}")
        runs = self._station.beating(LOOK_S)
        mode, active, mark = (self._station.read(name) if runs else NAN for name in (MODE, ACTIVE, APPLET))
        made = self._made
        fault = self.fault or (FREEZES if runs and self._station.lets_go(LOOK_S) is False else "")
        there = None if crc is None else made is not None and crc == ftp.crc32(made.text.encode())
        return State(fault, folder, there, runs, made is not None and mark == made.mark, mode, active)

    def deploy(self, receipts: Path, tell: Tell) -> Receipt | None:
        """Enable scripting, write the script, start it and prove that it runs; the feed-forward is off afterwards.

        Returns the receipt of the parameter that was written, if any. Raises ParamRejected for a wiring that does not
        fit and for an armed vehicle, and then sends nothing; ParamUnverified if the script does not run in the end.
        """
        made = self._made
        if made is None:
            raise ParamRejected(f"no applet: {self.fault}; nothing was sent")
        self._check_disarmed()
        receipt = self._write(receipts)
        if self.present[ENABLE] != 1:
            tell("rebooting the autopilot, for its scripting to start")
            self._station.reboot()
            if self._station.read(ENABLE) != 1:
                raise ParamUnverified(
                    f"the autopilot came back without {ENABLE} 1; nothing more was sent, try again"
                )
        folder = self._station.folder()
        if folder is None:
            raise ParamUnverified(
                f"the autopilot shows no folder {' or '.join(FOLDERS)}: is there a card in it?"
            )
        tell(f"writing {folder}/{NAME}, {len(made.text)} bytes")
        self._station.put(folder, made.text.encode())
        self._check_disarmed("the script is written and does not run yet: disarm it, and deploy again")
        self._restart(tell)
        if not self._station.beating(BEATS_WITHIN_S):
            raise ParamUnverified(
                "the script does not run: look at the autopilot's messages; for want of memory raise SCR_HEAP_SIZE"
            )
        lets_go = self._station.lets_go(BEATS_WITHIN_S)
        if not lets_go:
            self._take_out(tell)
            raise ParamRejected(
                f"no applet: {FREEZES}; the script was taken out again, reboot the autopilot"
                if lets_go is False
                else "the script has not proved that its overrides end by themselves; it was taken out again"
            )
        if self._station.read(APPLET) != made.mark:
            raise ParamUnverified(
                "another applet runs than the one that was written: reboot, and deploy again"
            )
        return receipt

    def remove(self, tell: Tell) -> None:
        """Take the script out, and prove that nothing of it runs. Raises ParamRejected for an armed vehicle."""
        self._check_disarmed()
        self._take_out(tell)
        if self._station.beating(LOOK_S):
            raise ParamUnverified("an applet runs all the same: reboot the autopilot, and look again")

    def _take_out(self, tell: Tell) -> None:
        folder = self._station.folder()
        if folder is not None:
            tell(f"removing {folder}/{NAME}")
            for name in (NAME, UNDER_WAY):
                self._station.ask_files(ftp.Op.REMOVE, f"{folder}/{name}".encode())
            if self._station.crc32(f"{folder}/{NAME}") is not None:
                raise ParamUnverified(f"{folder}/{NAME} is still there; try again")
            self._check_disarmed("the script is removed, and runs on all the same: disarm it, and try again")
            self._restart(tell)

    def _restart(self, tell: Tell) -> None:
        tell("starting the autopilot's scripts anew")
        self._station.order(dialect.MAV_CMD_SCRIPTING, RESTART)
        self._station.pause(DEAF_S)

    def _check_disarmed(self, now: str = "nothing was sent: disarm it") -> None:
        """Raise ParamRejected, with how it stands `now`, for a vehicle that is armed: a HEARTBEAT from before may be
        minutes old."""
        if self.client.armed or self._station.armed():
            raise ParamRejected(f"vehicle {self.target[0]} is armed; {now}")

    def _write(self, receipts: Path) -> Receipt | None:
        """Enable scripting, or force off the feed-forward of the script that runs: read back, with a receipt."""
        if self.present[ENABLE] != 1:
            values = {ENABLE: 1.0}
        elif self.present.get(MODE, 0.0) != Mode.OFF:
            values = {MODE: float(Mode.OFF)}
        else:
            return None
        plan = propose_upload(Path(NAME), Wanted(values), self.present, None, receipts, self.target[0])
        read_at = newest(receipts, self.target[0])
        order = plan.order(receipts, self._clock.unix_s(), even_armed=False, read_at=read_at)
        receipt = self.client.apply(order)
        if not receipt.good:
            raise ParamUnverified(f"{', '.join(values)}: {receipt.sentence}")
        return receipt
