"""The scripting of the fake ArduSub: files by MAVLink FTP, scripts that run, outputs that they override for a time."""

from fakes.lua import Script
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.wire import ftp
from bridge.wire.ftp import crc32

FUNCTIONS = tuple(f"SERVO{n}_FUNCTION" for n in range(1, 17))
FOLDER = "scripts"
LOOP_US = 2500
SCRIPT_TABLES = ("FF_", "FF0_")


class Scripting:
    """Host of the scripts of `autopilot`, with switches: `damages_files`, `lacks_memory`, `stop()`; `ends_overrides`:
    False as in a firmware whose Sub never calls SRV_Channels::calc_pwm (seen in 4.5.0-dev).

    `kept` are the parameters of scripts on its disk, `overrides` outputs (from 0) with a pulse and its end.
    """

    def __init__(self, autopilot):
        self.autopilot = autopilot
        self.files = {}
        self.open = None
        self.scripts = []
        self.tables = {}
        self.overrides = {}
        self.started_s = None
        self.velocity_m_s = (0.0, 0.0, 0.0)
        self.knows_velocity = True
        self.turn_rad_s = 0.0
        self.damages_files = False
        self.lacks_memory = False
        self.ends_overrides = True
        self.kept = {}

    # What happens to it.

    def boot(self, now_s):
        """Scripting starts some time after the autopilot; the parameters of scripts are gone until then."""
        enabled = self.autopilot.parameters["SCR_ENABLE"] == 1
        self.stop()
        for name in list(self.autopilot.parameters):
            if name.startswith(SCRIPT_TABLES):
                self.kept[name] = self.autopilot.parameters.pop(name)
        self.tables.clear()
        self.started_s = now_s if enabled else None
        if enabled:
            self.start(now_s)

    def start(self, now_s):
        for name, data in sorted(self.files.items()):
            if name.startswith(f"{FOLDER}/") and name.endswith(".lua"):
                if self.lacks_memory:
                    self.autopilot.say("Lua: not enough memory")
                else:
                    self.scripts.append(Script(data.decode(), self, now_s + 0.1))

    def stop(self):
        """Every script ends, as by an error; their parameters stay."""
        self.scripts.clear()

    def restart(self, now_s):
        self.stop()
        if self.started_s is not None:
            self.start(now_s)

    def step(self, now_s):
        for script in self.scripts:
            script.step(now_s)
            if script.error:
                self.autopilot.say(script.error[:50])
        self.scripts = [script for script in self.scripts if script.due_s is not None]
        if self.ends_overrides:
            held = self.overrides.items()
            self.overrides = {n: (us, end_s) for n, (us, end_s) in held if end_s > now_s + 1e-9}

    def overridden(self, pulses):
        return [self.overrides.get(n, (us,))[0] for n, us in enumerate(pulses)]

    # Files.

    def answer(self, packet):
        """MAVLink FTP as ArduPilot has it: no answer tells more than yes or no."""
        ok, no = ftp.acknowledged, ftp.refused(packet, ftp.Fault.FAIL)
        name = packet.data.decode(errors="replace")
        enabled = self.started_s is not None
        if packet.op == ftp.Op.LIST:
            there = enabled and name == FOLDER
            return ok(packet, b"D.\0D..\0") if there else ftp.refused(packet, ftp.Fault.NOT_FOUND)
        if packet.op in (ftp.Op.RESET, ftp.Op.TERMINATE):
            self.open = None
            return ok(packet)
        if packet.op == ftp.Op.CREATE:
            if self.open is not None:
                return no
            self.open, self.files[name] = name, b""
            return ok(packet)
        if packet.op == ftp.Op.WRITE:
            if self.open is None:
                return ftp.refused(packet, ftp.Fault.NOT_FOUND)
            data = packet.data[:-1] + b"?" if self.damages_files else packet.data
            before = self.files[self.open]
            self.files[self.open] = before[: packet.offset] + data + before[packet.offset + len(data) :]
            return ok(packet)
        if packet.op == ftp.Op.REMOVE:
            return no if self.files.pop(name, None) is None else ok(packet)
        if packet.op == ftp.Op.RENAME:
            old, _, new = name.partition("\0")
            if old not in self.files:
                return no
            self.files[new] = self.files.pop(old)
            return ok(packet)
        if packet.op == ftp.Op.CRC32:
            data = self.files.get(name)
            return no if data is None else ok(packet, crc32(data).to_bytes(4, "little"))
        return ftp.refused(packet, ftp.Fault.UNKNOWN)

    # The words of the scripts (`fakes.lua`).

    def add_table(self, key, prefix, count):
        del count
        return self.tables.setdefault(key, prefix) == prefix

    def add_param(self, key, index, name, default):
        del index
        name = self.tables[key] + name
        self.autopilot.parameters.setdefault(name, self.kept.get(name, float(default)))
        return True

    def known(self, name):
        return name in self.autopilot.parameters

    def get(self, name):
        return self.autopilot.parameters[name]

    def set(self, name, value):
        self.autopilot.parameters[name] = float(value)

    def micros(self):
        return round(self.autopilot.clock.now_s * 1e6) & 0xFFFFFFFF

    def text(self, severity, text):
        del severity
        self.autopilot.say(text)

    def named(self, name, value):
        boot_ms = round(self.autopilot.clock.now_s * 1e3)
        self.autopilot.send(dialect.MAVLink_named_value_float_message(boot_ms, name.encode(), value))

    def armed(self):
        return self.autopilot.armed

    def mode(self):
        return self.autopilot.mode

    def rc(self, channel):
        return self.autopilot.rc(channel)

    def has_velocity(self):
        return self.knows_velocity

    def velocity(self, axis):
        return self.velocity_m_s[axis - 1]

    def turn(self):
        return self.turn_rad_s

    def pwm(self, function):
        """The pulse of the first output with that function: what the mixer gives it."""
        for n, name in enumerate(FUNCTIONS):
            if self.autopilot.parameters[name] == function:
                return self.overrides.get(n, (self.autopilot.mixed()[n],))[0]
        return None

    def override(self, channel, pwm, ms):
        loops = -(-ms * 1000 // LOOP_US)
        self.overrides[channel] = (pwm, self.autopilot.clock.now_s + loops * LOOP_US * 1e-6)
