"""The parser of each kind of device, and the command that starts the device."""

from bridge.sensors.esc import EscParser
from bridge.sensors.kvh1750 import Kvh1750Parser
from bridge.sensors.kvh1760 import Kvh1760Parser, encode_setup
from bridge.sensors.samples import Parser
from bridge.sensors.streams import ClockFit
from bridge.sensors.waterlink import WaterlinkJsonParser, WaterlinkSerialParser
from bridge.sensors.wayfinder import EXIT_COMMAND_MODE, WayfinderParser, encode_command
from bridge.sensors.xsens import XsensParser
from bridge.vehicle.config import Device

MTI_TICK_S = 1e-4  # resolution of the MTi's SampleTimeFine
MTI_CLOCK_TOLERANCE = 1e-3
BACKLOG_S = 0.25
"""After the computer stood still, the bytes that waited in the port are read within this time."""
GYRO_RATE_HZ = 1000.0


def make_parser(device: Device, thrusters: int) -> Parser | None:
    """Return a new parser of a device's byte stream; None for the Bar30, which is polled over I2C."""
    latency_s = device.latency_s
    match device.kind:
        case "wayfinder":
            return WayfinderParser(latency_s)
        case "a50":
            return WaterlinkJsonParser(latency_s) if speaks_tcp(device) else WaterlinkSerialParser(latency_s)
        case "mti300":
            return XsensParser(latency_s, ClockFit(MTI_TICK_S, MTI_CLOCK_TOLERANCE, BACKLOG_S))
        case "kvh1750":
            return Kvh1750Parser(device.rate_hz or GYRO_RATE_HZ, latency_s)
        case "kvh1760":
            return Kvh1760Parser(device.rate_hz or GYRO_RATE_HZ, latency_s)
        case "esc":
            return EscParser(thrusters, device.poles, latency_s, device.rate_hz)
        case "ublox":
            # Its library takes a tenth of a second to import, and most dives don't need it.
            from bridge.sensors.ublox import UbloxParser

            return UbloxParser(latency_s)
        case "bar30":
            return None


def start_command(device: Device) -> bytes:
    """Return the bytes to send to a device when its port opens, so that it measures; b"" if it starts by itself.

    Raises ConfigError for a rate that the device does not have.
    """
    if device.kind == "wayfinder":
        return encode_command(EXIT_COMMAND_MODE)
    if device.kind == "kvh1760":
        return encode_setup(round(device.rate_hz or GYRO_RATE_HZ))
    return b""


def speaks_tcp(device: Device) -> bool:
    """Whether a device is reached over the network. The Water Linked A50 speaks JSON there."""
    return device.port.startswith("tcp:")
