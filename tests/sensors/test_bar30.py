"""Vectors: DATASHEET is the worked example of the MS5837-30BA datasheet, AN520 that of TE's application
note on the CRC; the PROM of the fake holds the datasheet's words with a CRC of our own."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.clock import SimulatedClock
from bridge.errors import ConfigError, LinkError, LinkLost
from bridge.sensors.bar30 import (
    Bar30,
    Calibration,
    FakeBar30,
    SmbusBus,
    compensate,
    crc4,
    parse_i2c_port,
    raw_readings,
)

DATASHEET = Calibration(34982, 36352, 20328, 22354, 26646, 26146)
AN520 = (0x3132, 0x3334, 0x3536, 0x3738, 0x3940, 0x4142, 0x4344, 0x4500)


class Waits:
    """A wait that moves a clock and remembers how long it was asked to wait."""

    def __init__(self, clock):
        self.clock, self.asked = clock, []

    def __call__(self, seconds):
        self.asked.append(seconds)
        self.clock.advance_to(self.clock.now_s + seconds)


def no_wait(_seconds):
    pass


def datasheet_arithmetic(d1, d2, c):
    """Pressure (0.1 mbar) and temperature (0.01 deg C) in the whole numbers of the datasheet's flow
    charts."""
    dt = d2 - c.c5 * 256
    temp = 2000 + dt * c.c6 // 8388608
    off = c.c2 * 65536 + c.c4 * dt // 128
    sens = c.c1 * 32768 + c.c3 * dt // 256
    if temp < 2000:
        ti = 3 * dt * dt // 8589934592
        offi = 3 * (temp - 2000) ** 2 // 2
        sensi = 5 * (temp - 2000) ** 2 // 8
        if temp < -1500:
            offi += 7 * (temp + 1500) ** 2
            sensi += 4 * (temp + 1500) ** 2
    else:
        ti = 2 * dt * dt // 137438953472
        offi = (temp - 2000) ** 2 // 16
        sensi = 0
    return (d1 * (sens - sensi) // 2097152 - (off - offi)) // 8192, temp - ti


def sensor(bus):
    clock = SimulatedClock(100.0)
    waits = Waits(clock)
    return Bar30(bus, waits), clock, waits


def test_the_datasheets_example_gives_its_pressure_and_temperature():
    pressure_pa, temperature_c = compensate(4958179, 6815414, DATASHEET)
    assert pressure_pa / 10 == pytest.approx(39998, abs=0.5)
    assert temperature_c * 100 == pytest.approx(1981, abs=0.5)


@settings(max_examples=200)
@given(st.integers(3_000_000, 9_000_000), st.integers(5_600_000, 8_600_000))
def test_the_compensation_is_the_datasheets_whole_number_arithmetic_but_for_rounding(d1, d2):
    pressure_pa, temperature_c = compensate(d1, d2, DATASHEET)
    pressure, temperature = datasheet_arithmetic(d1, d2, DATASHEET)
    assert pressure_pa / 10 == pytest.approx(pressure, abs=4)
    assert temperature_c * 100 == pytest.approx(temperature, abs=2)


def test_the_crc_is_that_of_the_makers_application_note():
    assert crc4(AN520) == 0xB


def test_every_flipped_bit_of_the_calibration_is_refused():
    for bit in range(7 * 16):
        with pytest.raises(LinkError, match="CRC"):
            Bar30(FakeBar30(flipped_prom_bit=bit), no_wait)


def test_a_bus_whose_data_line_is_held_low_is_no_sensor():
    """All of its words read as zero, and a CRC of zeros is zero: the surface would lie ten metres below."""
    bus = FakeBar30(calibration=Calibration(0, 0, 0, 0, 0, 0), converts=False)
    with pytest.raises(LinkError, match="check the wiring"):
        Bar30(bus, no_wait)


@settings(max_examples=200)
@given(st.floats(0, 30e5), st.floats(-19.9, 84.9))
def test_raw_readings_are_the_inverse_of_the_compensation(pressure_pa, temperature_c):
    d1, d2 = raw_readings(pressure_pa, temperature_c, DATASHEET)
    pressure, temperature = compensate(d1, d2, DATASHEET)
    assert pressure == pytest.approx(pressure_pa, abs=1.0)
    assert temperature == pytest.approx(temperature_c, abs=2e-3)


def test_the_driver_measures_what_the_water_is():
    bar30, clock, _ = sensor(FakeBar30(pressure_pa=153_200.0, temperature_c=8.5))
    sample = bar30.measure(clock)
    assert sample.pressure_pa == pytest.approx(153_200.0, abs=1.0)
    assert sample.temperature_c == pytest.approx(8.5, abs=2e-3)


def test_a_sample_is_dated_in_the_middle_of_its_pressure_conversion():
    bar30, clock, waits = sensor(FakeBar30())
    begun_s = clock.now_s
    sample = bar30.measure(clock)
    assert waits.asked == [0.01, 0.02048, 0.02048]
    assert sample.time_s == pytest.approx(begun_s + 0.01024)


def test_a_conversion_that_did_not_happen_gives_no_sample():
    bus = FakeBar30()
    bar30, clock, _ = sensor(bus)
    bus.converts = False
    assert bar30.measure(clock) is None
    bus.converts = True
    assert bar30.measure(clock) is not None


@pytest.mark.parametrize(
    ("pressure_pa", "temperature_c"), [(-5e3, 15.0), (40e5, 15.0), (1e5, 95.0), (1e5, -30.0)]
)
def test_what_the_sensor_can_not_measure_gives_no_sample(pressure_pa, temperature_c):
    bar30, clock, _ = sensor(FakeBar30(pressure_pa, temperature_c))
    assert bar30.measure(clock) is None


def test_a_sensor_that_is_unplugged_is_a_lost_link_and_comes_back():
    bus = FakeBar30()
    bar30, clock, _ = sensor(bus)
    bus.unplugged = True
    with pytest.raises(LinkLost, match="0x76"):
        bar30.measure(clock)
    bus.unplugged = False
    assert bar30.measure(clock) is not None


def test_a_sensor_at_another_address_does_not_answer():
    with pytest.raises(LinkLost, match="0x77"):
        Bar30(FakeBar30(), no_wait, address=0x77)


def test_a_bus_that_is_not_there_is_named():
    with pytest.raises(LinkError, match="/dev/i2c-250"):
        SmbusBus(250)


@pytest.mark.parametrize(("port", "parsed"), [("1:0x76", (1, 0x76)), ("10:119", (10, 119)), ("4", (4, 0x76))])
def test_an_i2c_port_names_bus_and_address(port, parsed):
    assert parse_i2c_port(port) == parsed


@pytest.mark.parametrize("port", ["", "/dev/i2c-1", "1:0x200", "-1:0x76", "1:water"])
def test_a_port_that_names_none_is_refused(port):
    with pytest.raises(ConfigError, match="1:0x76"):
        parse_i2c_port(port)
