"""Blue Robotics Bar30: the MS5837-30BA pressure sensor, over I2C.

Source: TE Connectivity's MS5837-30BA datasheet (commands, CRC, first and second order compensation), as in github
bluerobotics/ms5837-python. It measures 0 to 30 bar to about 0.2 mbar, but its offset may be off by 50 mbar: zero the
surface pressure before every dive.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, Self

from bridge.clock import Clock
from bridge.errors import ConfigError, LinkError, LinkLost
from bridge.sensors.samples import PressureSample

ADDRESS = 0x76

_RESET, _READ_ADC, _CONVERT_D1, _CONVERT_D2, _READ_PROM = 0x1E, 0x00, 0x40, 0x50, 0xA0
_PROM_WORDS = 7
_FINEST = 5  # oversampling 8192
_RESET_S = 0.01
_CONVERSION_S = 2.5e-6  # for each of the 256 << oversampling readings that a conversion averages
_PA_PER_COUNT = 10.0  # the datasheet's pressures are in 0.1 mbar
_PRESSURES_PA = (0.0, 31e5)
_TEMPERATURES_C = (-20.0, 85.0)


class I2cBus(Protocol):
    """The bus functions that the driver needs; `write` and `read` raise LinkLost if the device does not answer."""

    def write(self, address: int, data: bytes) -> None: ...

    def read(self, address: int, count: int) -> bytes: ...

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class Calibration:
    """The six factory words of a sensor, by the names of the datasheet."""

    c1: int
    c2: int
    c3: int
    c4: int
    c5: int
    c6: int

    @classmethod
    def from_prom(cls, words: Sequence[int]) -> Self:
        """Build the calibration from PROM words. Raises LinkError if they do not match their CRC, or are all zero."""
        # A data line that is held low reads as zeros, whose CRC is right, and then as 0 Pa at 20 deg C.
        if not any(words) or prom_crc(words) != words[0] >> 12:
            raise LinkError(
                "the Bar30's calibration memory does not match its CRC; check the wiring, then the sensor"
            )
        return cls(*words[1:])

    def prom(self) -> tuple[int, ...]:
        words = (0, self.c1, self.c2, self.c3, self.c4, self.c5, self.c6)
        return (prom_crc(words) << 12, *words[1:])


def crc4(words: Sequence[int]) -> int:
    """The 4-bit CRC of eight 16-bit words (TE application note AN520)."""
    remainder = 0
    for byte in (byte for word in words for byte in (word >> 8, word & 0xFF)):
        remainder ^= byte
        for _ in range(8):
            remainder = remainder << 1 ^ (0x3000 if remainder & 0x8000 else 0)
        remainder &= 0xFFFF
    return remainder >> 12


def prom_crc(words: Sequence[int]) -> int:
    """The CRC of seven PROM words; the CRC field itself, the top nibble of the first word, counts as zero."""
    return crc4((words[0] & 0x0FFF, *words[1:], 0))


def compensate(d1: int, d2: int, calibration: Calibration) -> tuple[float, float]:
    """Pressure (Pa) and temperature (deg C) from raw readings, second order, without the datasheet's rounding."""
    first, excess = _first_order_temperature(d2, calibration)
    offset, sensitivity = _second_order(first, excess, calibration)
    pressure = (d1 * sensitivity / 2**21 - offset) / 2**13
    return pressure * _PA_PER_COUNT, (first - _temperature_error(first, excess)) / 100


def raw_readings(pressure_pa: float, temperature_c: float, calibration: Calibration) -> tuple[int, int]:
    """The raw readings D1, D2 that `compensate` converts to this pressure and temperature."""
    reference = calibration.c5 * 2**8
    excess = 0.0
    for _ in range(30):
        first = 2000 + excess * calibration.c6 / 2**23
        wanted = 100 * temperature_c + _temperature_error(first, excess)
        excess = (wanted - 2000) * 2**23 / calibration.c6
    d2 = round(reference + excess)
    first, excess = _first_order_temperature(d2, calibration)
    offset, sensitivity = _second_order(first, excess, calibration)
    return round((pressure_pa / _PA_PER_COUNT * 2**13 + offset) * 2**21 / sensitivity), d2


def _first_order_temperature(d2: int, calibration: Calibration) -> tuple[float, float]:
    """TEMP (0.01 deg C) and dT of the datasheet."""
    excess = d2 - calibration.c5 * 2**8
    return 2000 + excess * calibration.c6 / 2**23, excess


def _temperature_error(first: float, excess: float) -> float:
    return 3 * excess**2 / 2**33 if first < 2000 else 2 * excess**2 / 2**37


def _second_order(first: float, excess: float, calibration: Calibration) -> tuple[float, float]:
    """OFF2 and SENS2 of the datasheet."""
    offset = calibration.c2 * 2**16 + calibration.c4 * excess / 2**7
    sensitivity = calibration.c1 * 2**15 + calibration.c3 * excess / 2**8
    below_20 = (first - 2000) ** 2
    if first >= 2000:
        return offset - below_20 / 2**4, sensitivity
    offset -= 3 * below_20 / 2
    sensitivity -= 5 * below_20 / 2**3
    if first < -1500:
        below_minus_15 = (first + 1500) ** 2
        offset -= 7 * below_minus_15
        sensitivity -= 4 * below_minus_15
    return offset, sensitivity


class Bar30:
    """The sensor on a bus. `wait` sleeps for the given seconds."""

    def __init__(self, bus: I2cBus, wait: Callable[[float], None], address: int = ADDRESS) -> None:
        """Reset the sensor and read its calibration. Raises LinkError if the calibration is corrupt, LinkLost if the
        sensor does not answer."""
        self._bus = bus
        self._wait = wait
        self._address = address
        bus.write(address, bytes((_RESET,)))
        wait(_RESET_S)
        words = [int.from_bytes(self._ask(_READ_PROM + 2 * i, 2), "big") for i in range(_PROM_WORDS)]
        self._calibration = Calibration.from_prom(words)

    def measure(self, clock: Clock) -> PressureSample | None:
        """Measure a sample, dated in the middle of its pressure conversion; None if it is not plausible.

        Takes two conversions, 42 ms together. Raises LinkLost if the device no longer answers.
        """
        begun_s = clock.boot_s()
        d1 = self._convert(_CONVERT_D1)
        time_s = (begun_s + clock.boot_s()) / 2
        d2 = self._convert(_CONVERT_D2)
        # A conversion that the device did not make reads as 0, which lies outside of both ranges.
        pressure_pa, temperature_c = compensate(d1, d2, self._calibration)
        if not (
            _PRESSURES_PA[0] <= pressure_pa <= _PRESSURES_PA[1]
            and _TEMPERATURES_C[0] <= temperature_c <= _TEMPERATURES_C[1]
        ):
            return None
        return PressureSample(time_s, pressure_pa, temperature_c)

    def _convert(self, command: int) -> int:
        self._bus.write(self._address, bytes((command + 2 * _FINEST,)))
        self._wait(_CONVERSION_S * (256 << _FINEST))
        return int.from_bytes(self._ask(_READ_ADC, 3), "big")

    def _ask(self, command: int, count: int) -> bytes:
        self._bus.write(self._address, bytes((command,)))
        return self._bus.read(self._address, count)


@dataclass
class FakeBar30:
    """A simulated bus with a Bar30 at `pressure_pa` and `temperature_c`; the faults are switches.

    Its calibration is the datasheet's example. `closed` counts the calls of `close`.
    """

    pressure_pa: float = 101325.0
    temperature_c: float = 15.0
    calibration: Calibration = Calibration(34982, 36352, 20328, 22354, 26646, 26146)
    address: int = ADDRESS
    unplugged: bool = False
    converts: bool = True
    flipped_prom_bit: int | None = None
    closed: int = 0
    _command: int = 0
    _reading: int = 0

    def write(self, address: int, data: bytes) -> None:
        self._answer(address)
        self._command = data[0]
        if self.converts and self._command & 0xE0 == _CONVERT_D1:
            d1, d2 = raw_readings(self.pressure_pa, self.temperature_c, self.calibration)
            reading = d2 if self._command & _CONVERT_D2 == _CONVERT_D2 else d1
            self._reading = min(max(reading, 0), 2**24 - 1)

    def read(self, address: int, count: int) -> bytes:
        self._answer(address)
        if self._command == _READ_ADC:
            reading, self._reading = self._reading, 0
            return reading.to_bytes(3, "big")[:count]
        image = bytearray(b"".join(word.to_bytes(2, "big") for word in self.calibration.prom()))
        if self.flipped_prom_bit is not None:
            image[self.flipped_prom_bit // 8] ^= 0x80 >> self.flipped_prom_bit % 8
        at = self._command - _READ_PROM
        return bytes(image[at : at + count])

    def close(self) -> None:
        self.closed += 1

    def _answer(self, address: int) -> None:
        if self.unplugged or address != self.address:
            raise LinkLost(f"nothing answers at I2C address {address:#x}; check the wiring")


class SmbusBus:
    """An I2C bus of the computer, `/dev/i2c-<number>`."""

    def __init__(self, number: int) -> None:
        import smbus2

        self._number = number
        self._message = smbus2.i2c_msg
        try:
            self._bus = smbus2.SMBus(number)
        except OSError as error:
            raise LinkError(
                f"/dev/i2c-{number} can't be opened ({error.strerror}); enable I2C or name another bus"
            ) from None

    def write(self, address: int, data: bytes) -> None:
        self._transfer(self._message.write(address, data), address)

    def read(self, address: int, count: int) -> bytes:
        message = self._message.read(address, count)
        self._transfer(message, address)
        return bytes(message)

    def close(self) -> None:
        self._bus.close()

    def _transfer(self, message: object, address: int) -> None:
        try:
            self._bus.i2c_rdwr(message)
        except OSError as error:
            raise LinkLost(
                f"nothing answers at I2C address {address:#x} on bus {self._number} ({error.strerror}); "
                "check the wiring"
            ) from None


def parse_i2c_port(port: str) -> tuple[int, int]:
    """Parse `bus:address`, such as `1:0x76`, `i2c:1:0x76` or just `1`, into numbers. Raises ConfigError."""
    number, _, address = port.removeprefix("i2c:").partition(":")
    try:
        parsed = int(number), int(address, 0) if address else ADDRESS
    except ValueError:
        raise ConfigError(f"'{port}' names no I2C device; write bus:address, as 1:0x76") from None
    if parsed[0] < 0 or not 0x08 <= parsed[1] <= 0x77:
        raise ConfigError(f"'{port}' is no I2C bus and address; addresses run from 0x08 to 0x77, as 1:0x76")
    return parsed
