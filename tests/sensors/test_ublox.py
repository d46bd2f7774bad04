"""Vectors: GGA and RMC are the well-known pair of the NMEA literature (48 07.038 N); the CFG-MSG commands
are the ones that u-blox's documentation and users print. UBX NAV messages are built by pyubx2, so not by
the hand that decodes."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyubx2 import GET, UBXMessage
from sensor_streams import fed

from bridge.sensors.samples import GnssSample
from bridge.sensors.ublox import (
    FIX_2D,
    FIX_3D,
    FIX_DGPS,
    NO_FIX,
    RTK_FIXED,
    UbloxParser,
    encode_nav_pvt,
    encode_nmea,
    encode_ubx,
)

GGA = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n"
RMC = b"$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W*6A\r\n"
PVT_FIELDS = {
    "fixType": 3,
    "gnssFixOk": 1,
    "numSV": 9,
    "lat": 59.91,
    "lon": -10.75,
    "hMSL": 12_500,
    "hAcc": 2100,
}
PVT_FIELDS |= {"gSpeed": 500, "headMot": 57.3}


def nav(name, **fields):
    return UBXMessage("NAV", f"NAV-{name}", GET, **fields).serialize()


PVT = nav("PVT", **PVT_FIELDS)


def assert_the_fix(sample):
    assert (sample.fix_type, sample.satellites) == (FIX_3D, 9)
    place = (sample.latitude_deg, sample.longitude_deg, sample.altitude_m, sample.horizontal_sigma_m)
    assert place == pytest.approx((59.91, -10.75, 12.5, 2.1))
    assert (sample.speed_m_s, math.degrees(sample.course_rad)) == pytest.approx((0.5, 57.3))


def test_nav_pvt_is_a_fix_at_arrival_less_latency():
    parser = UbloxParser(latency_s=0.25)
    (sample,) = parser.feed(PVT, 10.0)
    assert sample.time_s == 9.75
    assert_the_fix(sample)


def test_the_84_bytes_of_a_u_blox_7_are_read_as_the_92_of_later_ones():
    (sample,) = UbloxParser().feed(encode_ubx(b"\x01\x07", PVT[6 : 6 + 84]), 10.0)
    assert_the_fix(sample)


def test_the_well_known_sentences_are_a_fix():
    (sample,) = UbloxParser().feed(GGA + RMC, 10.0)
    assert (sample.fix_type, sample.satellites) == (FIX_3D, 8)
    assert (sample.latitude_deg, sample.longitude_deg) == pytest.approx((48 + 7.038 / 60, 11 + 31.0 / 60))
    assert sample.altitude_m == 545.4
    assert sample.speed_m_s == pytest.approx(22.4 * 0.514444, rel=1e-5)
    assert math.degrees(sample.course_rad) == pytest.approx(84.4)
    assert math.isnan(sample.horizontal_sigma_m)


@pytest.mark.parametrize(
    ("fields", "fix_type"),
    [
        ({"fixType": 0}, NO_FIX),
        ({"fixType": 1}, NO_FIX),
        ({"fixType": 2}, FIX_2D),
        ({"fixType": 4}, FIX_3D),
        ({"fixType": 5}, NO_FIX),
        ({"diffSoln": 1}, FIX_DGPS),
        ({"gnssFixOk": 0}, NO_FIX),
    ],
)
def test_the_fix_type_is_mavlinks(fields, fix_type):
    (sample,) = UbloxParser().feed(nav("PVT", **{**PVT_FIELDS, **fields}), 0.0)
    assert sample.fix_type == fix_type
    assert math.isnan(sample.latitude_deg) == (fix_type == NO_FIX)


@pytest.mark.parametrize(
    ("quality", "fix_type"), [("0", NO_FIX), ("2", FIX_DGPS), ("4", RTK_FIXED), ("6", NO_FIX)]
)
def test_the_quality_of_a_sentence_is_mavlinks_fix_type(quality, fix_type):
    gga = encode_nmea(f"GPGGA,123519,4807.038,N,01131.000,E,{quality},08,0.9,545.4,M,46.9,M,,")
    (sample,) = UbloxParser().feed(gga + RMC, 0.0)
    assert sample.fix_type == fix_type


def test_without_a_fix_position_and_motion_are_nan():
    empty = encode_nmea("GPGGA,123519,,,,,0,00,99.99,,,,,,") + encode_nmea("GPRMC,123519,V,,,,,,,230394,,,N")
    void = GGA + encode_nmea("GPRMC,123519,V,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W")
    pvt = nav("PVT", **{**PVT_FIELDS, "fixType": 0})
    for data in (empty, void, pvt):
        (sample,) = UbloxParser().feed(data, 0.0)
        assert sample.fix_type == NO_FIX
        assert all(map(math.isnan, (sample.latitude_deg, sample.longitude_deg, sample.altitude_m)))
        assert all(map(math.isnan, (sample.speed_m_s, sample.course_rad)))


def test_nav_pvt_silences_the_sentences_until_it_has_been_silent_itself():
    parser = UbloxParser()
    assert len(parser.feed(GGA + RMC, 0.0)) == 1
    assert len(parser.feed(PVT, 2.0)) == 1
    assert parser.feed(GGA + RMC, 2.1) == []
    assert len(parser.feed(GGA + RMC, 8.0)) == 1


def test_sentences_of_different_epochs_are_not_put_together():
    later = encode_nmea("GPRMC,123520,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W")
    assert UbloxParser().feed(GGA + later, 0.0) == []


@pytest.mark.parametrize(
    "data",
    [
        encode_nmea("GPGSV,1,1,00"),
        encode_nmea("PUBX,00,1"),
        encode_ubx(b"\x01\x30", bytes(20)),
        encode_ubx(b"\x05\x01", b"\x06\x01"),
        encode_nmea("GPGGA,123519,4807.038,N,01131.000,E,x,08,0.9,545.4,M,46.9,M,,"),
        GGA.replace(b"4807", b"4808"),
        GGA.replace(b"*47", b""),
        PVT[:30] + bytes((PVT[30] ^ 1,)) + PVT[31:],
        encode_ubx(b"\x01\x07", bytes(10)),
        nav("PVT", **{**PVT_FIELDS, "lat": 91.0}),
    ],
)
def test_what_gives_no_fix_is_passed_over_and_the_next_is_read(data):
    # What looks like the head of a message may take the next one with it.
    assert 1 <= len(fed(UbloxParser(), [data, PVT, PVT])) <= 2


def test_numbers_that_are_none_do_not_become_a_fix():
    gga = encode_nmea("GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,inf,M,nan,M,,")
    rmc = encode_nmea("GPRMC,123519,A,4807.038,N,01131.000,E,nan,inf,230394,003.1,W")
    (sample,) = UbloxParser().feed(gga + rmc, 0.0)
    assert all(map(math.isnan, (sample.altitude_m, sample.speed_m_s, sample.course_rad)))


@pytest.mark.parametrize("data", [b"$" + b"G" * 5000, b"$GPGGA," + b"1" * 200 + b"\r\n"])
def test_an_overlong_sentence_is_passed_over(data):
    parser = UbloxParser()
    assert len(parser.feed(data + PVT, 0.0)) == 1


@settings(max_examples=50)
@given(
    st.floats(-89.9, 89.9),
    st.floats(-179.9, 179.9),
    st.floats(-400, 9000),
    st.floats(0, 100),
    st.floats(0, 6.28),
    st.sampled_from([FIX_2D, FIX_3D, FIX_DGPS]),
)
def test_what_is_encoded_is_what_is_parsed(latitude, longitude, altitude, speed, course, fix_type):
    given_sample = GnssSample(10.0, fix_type, latitude, longitude, altitude, 2.5, speed, course, 11)
    (sample,) = UbloxParser().feed(encode_nav_pvt(given_sample, 123_000), 10.0)
    assert (sample.fix_type, sample.satellites) == (fix_type, 11)
    assert (sample.latitude_deg, sample.longitude_deg) == pytest.approx((latitude, longitude), abs=0.51e-7)
    assert (sample.altitude_m, sample.speed_m_s) == pytest.approx((altitude, speed), abs=0.51e-3)
    assert sample.course_rad == pytest.approx(course, abs=2e-7)


def test_a_sample_without_a_fix_is_encoded_without_one():
    nan = math.nan
    lost = GnssSample(10.0, NO_FIX, nan, nan, nan, nan, nan, nan, 3)
    assert repr(UbloxParser().feed(encode_nav_pvt(lost, 0), 10.0)) == repr([lost])
