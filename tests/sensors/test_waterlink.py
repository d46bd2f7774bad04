"""Vectors: REPORT and the sentences of DOCUMENTED are the examples of Water Linked's own documentation of the
protocols (github waterlinked/docs, dvl-protocol.md), REPORT with every field and with numbers cut to six places."""

import json
import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sensor_streams import fed, random_chunks

from bridge.sensors.waterlink import (
    WaterlinkJsonParser,
    WaterlinkSerialParser,
    encode_sentence,
    encode_waterlink_json,
    encode_waterlink_serial,
)

BEAMS = [(0.000108, 0.5568, -30.49, -88.73), (-1.472e-05, 0.5664, -31.1, -89.51)]
BEAMS += [(2.786e-05, 0.5376, -27.18, -96.98), (1.942e-05, 0.5472, -28.01, -88.32)]
FIELDS = {
    "time": 106.393578,
    "vx": -3.7e-05,
    "vy": 5.7e-05,
    "vz": 2.5e-05,
    "fom": 0.00016,
    "covariance": [[2.4e-08, -3.4e-09, -1.7e-09], [-3.4e-09, 1.5e-08, 4.0e-10], [-1.7e-09, 4.0e-10, 1.6e-09]],
    "altitude": 0.494982,
    "transducers": [
        {"id": i, "velocity": v, "distance": d, "rssi": r, "nsd": n, "beam_valid": True}
        for i, (v, d, r, n) in enumerate(BEAMS)
    ],
    "velocity_valid": True,
    "status": 0,
    "format": "json_v3.1",
    "type": "velocity",
    "time_of_validity": 1638191471563017,
    "time_of_transmission": 1638191471752336,
}
DOCUMENTED = {
    "wrz": b"wrz,0.120,-0.400,2.000,y,1.30,1.855,1e-07;0;1.4;0;1.2;0;0.2;0;1e+09,7,14,123.00,1*50",
    "wru": b"wru,0,0.070,1.10,-40,-95*9c",
    "wrp": b"wrp,49056.809,0.41,0.15,1.23,0.4,53.9,13.0,19.3,0*de",
    "wrx": b"wrx,1164.94,0.000,0.000,0.000,2.707,-1.00,n,1*39",
}
NAN = math.nan


def line(**changes):
    return json.dumps({**FIELDS, **changes}).encode() + b"\r\n"


REPORT = line()


def test_the_documented_report_decodes_to_its_values_at_its_time_of_validity():
    parser = WaterlinkJsonParser(latency_s=0.5)
    (sample,) = parser.feed(REPORT, 10.0)
    assert sample.velocity == (-3.7e-05, 5.7e-05, 2.5e-05)
    assert (sample.sigma, sample.altitude_m) == (0.00016, 0.494982)
    assert sample.time_s == pytest.approx(10.0 - 0.189319)


def test_the_documented_sentence_decodes_to_its_values():
    parser = WaterlinkSerialParser()
    (sample,) = parser.feed(DOCUMENTED["wrz"] + b"\r\n", 10.0)
    assert (sample.velocity, sample.altitude_m, sample.sigma) == ((0.12, -0.4, 2.0), 1.3, 1.855)
    assert sample.time_s == pytest.approx(10.0 - 7e-6)


@pytest.mark.parametrize("name", DOCUMENTED)
def test_the_documented_sentences_pass_their_checksum_with_each_line_end(name):
    for end in (b"\n", b"\r\n", b"\r"):
        assert len(WaterlinkSerialParser().feed(DOCUMENTED[name] + end, 0.0)) == (name == "wrz")
    assert encode_sentence(DOCUMENTED[name][:-3].decode()) == DOCUMENTED[name] + b"\r\n"


@pytest.mark.parametrize(
    ("stamps", "age_s"),
    [
        ((), 0.25),
        ((0, 0), 0.25),
        ((50_000_000, 1), 0.25),
        ((10, 9_000_000), 0.25),
        ((2_000_100, 2_000_000), 0.0),
        ((2_000_000, 2_100_000), 0.1),
    ],
)
def test_a_report_without_times_that_make_sense_has_the_configured_latency_and_none_is_of_the_future(
    stamps, age_s
):
    fields = {key: value for key, value in FIELDS.items() if not key.startswith("time_of")}
    fields |= dict(zip(("time_of_validity", "time_of_transmission"), stamps, strict=False))
    (sample,) = WaterlinkJsonParser(latency_s=0.25).feed(json.dumps(fields).encode() + b"\n", 10.0)
    assert sample.time_s == 10.0 - age_s


def test_a_lost_lock_is_nan_whatever_velocity_stands_beside_it():
    lost = line(velocity_valid=False, vx=0.0, vy=0.0, vz=0.0, altitude=-1.0, fom=0.0)
    sentence = encode_sentence("wrz,0.000,0.000,0.000,n,-1.00,2.707,0;0;0;0;0;0;0;0;0,7,14,123.00,1")
    for sample in WaterlinkJsonParser().feed(lost, 0.0) + WaterlinkSerialParser().feed(sentence, 0.0):
        assert not sample.locked
        assert all(map(math.isnan, (*sample.velocity, sample.sigma, sample.altitude_m)))


@pytest.mark.parametrize(
    "bad",
    [
        b"{",
        b"[1, 2]",
        b"\xff\xfe{}",
        b"[" * 10_000,
        b"null",
        b'{"type": "velocity"}',
        line(vx=None)[:-2],
        line(vx=True)[:-2],
        line(vx="0.1")[:-2],
        line(velocity_valid="y")[:-2],
        line(velocity_valid=None)[:-2],
        line(time_of_validity=[])[:-2],
        line(vx=10**400)[:-2],
        b"1" * 5000,
    ],
)
def test_a_bad_line_is_passed_over_and_the_next_report_is_read(bad):
    parser = WaterlinkJsonParser()
    assert len(parser.feed(bad + b"\r\n" + REPORT, 0.0)) == 1


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "21"])
def test_a_velocity_that_no_vehicle_has_gives_no_sample(number):
    for axis in ("vx", "vy", "vz"):
        parser = WaterlinkJsonParser()
        fields = json.dumps({**FIELDS, axis: 12345.0}).replace("12345.0", number)
        assert parser.feed(fields.encode() + b"\n", 0.0) == []


def test_a_number_that_is_none_beside_the_velocity_costs_only_itself():
    fields = (
        json.dumps({**FIELDS, "fom": 111.0, "altitude": 222.0})
        .replace("111.0", "NaN")
        .replace("222.0", "1e999")
    )
    (sample,) = WaterlinkJsonParser().feed(fields.encode() + b"\n", 0.0)
    assert sample.locked
    assert math.isnan(sample.sigma)
    assert math.isnan(sample.altitude_m)


def test_other_reports_are_ignored():
    parser = WaterlinkJsonParser()
    for message in (
        {"type": "velocity_water", "vx": 1.0},
        {"vx": 1.0},
        {"type": "response", "success": True},
    ):
        assert parser.feed(json.dumps(message).encode() + b"\n", 0.0) == []


@pytest.mark.parametrize(
    "sentence",
    [
        b"wrz,1,2,3\n",
        encode_sentence("wrz,1,2,3"),
        encode_sentence("wrz,0,0,0,x,1,0,0;0;0;0;0;0;0;0;0,7,14,1,0"),
        encode_sentence("wrz,a,0,0,y,1,0,0;0;0;0;0;0;0;0;0,7,14,1,0"),
        encode_sentence("wrz,nan,0,0,y,1,0,0;0;0;0;0;0;0;0;0,7,14,1,0"),
        encode_sentence("wrz,0,0,inf,y,1,0,0;0;0;0;0;0;0;0;0,7,14,1,0"),
        encode_sentence("wrz,0,0,0,y,1,0,0;0;0;0;0;0;0;0;0,7,14,1,0,5"),
        encode_sentence("wrz,0,0,0,y,1,0,0;0;0;0;0;0;0;0,7,14,1,0"),
        encode_sentence("wrz,0,0,0,y,1,0,0;0;0;0;1_0;0;0;0;0,7,14,1,0"),
        encode_sentence("wr?"),
        encode_sentence("wrq,1"),
        DOCUMENTED["wrz"].replace(b"0.120", b"0.121") + b"\n",
        DOCUMENTED["wru"].upper() + b"\n",
    ],
)
def test_a_bad_sentence_is_passed_over_and_the_next_is_read(sentence):
    parser = WaterlinkSerialParser()
    assert len(parser.feed(sentence + DOCUMENTED["wrz"] + b"\n", 0.0)) == 1


GOOD = [
    "0.120",
    "-0.400",
    "2.000",
    "y",
    "1.30",
    "1.855",
    "1e-07;0;1.4;0;1.2;0;0.2;0;1e+09",
    "7",
    "14",
    "123.00",
    "1",
]


@pytest.mark.parametrize("text", ["1_0", " 1", "1 ", "", "0x1", "infinity", "1e", ".", "--1", "1e1_0"])
def test_a_field_that_is_not_plainly_a_number_makes_the_sentence_malformed(text):
    for place in (0, 1, 2, 4, 5, 7, 8, 9, 10):
        fields = [*GOOD[:place], text, *GOOD[place + 1 :]]
        assert WaterlinkSerialParser().feed(encode_sentence("wrz," + ",".join(fields)), 0.0) == [], place


@pytest.mark.parametrize("text", ["5", "+0.5", "-.5", "5.", "1e-07", "1E+0"])
def test_every_plain_form_of_a_number_is_read(text):
    (sample,) = WaterlinkSerialParser().feed(encode_sentence("wrz," + ",".join([text, *GOOD[1:]])), 0.0)
    assert sample.velocity[0] == float(text)


@pytest.mark.parametrize(
    ("make", "overlong", "good"),
    [
        (WaterlinkJsonParser, b" " * 16384 + REPORT, REPORT),
        (
            WaterlinkSerialParser,
            encode_sentence("wrz," + ",".join(["0" * 1024, *GOOD[1:]])),
            encode_sentence("wrz," + ",".join(GOOD)),
        ),
    ],
)
def test_an_overlong_line_is_discarded_to_its_end(make, overlong, good):
    stream = overlong + good
    for pieces in ([stream], random_chunks(stream, random.Random(1), 500)):
        parser = make()
        assert len(fed(parser, pieces)) == 1


speeds = st.floats(-6, 6)
ranges = st.floats(0.05, 50) | st.just(NAN)


@settings(max_examples=50)
@given(st.tuples(speeds, speeds, speeds), st.floats(0, 50), st.floats(0, 1), st.tuples(*[ranges] * 4))
def test_what_is_encoded_is_what_is_parsed(velocity, altitude_m, sigma, beams):
    stamps = (1_700_000_000_000_000, 1_700_000_000_050_000)
    (sample,) = WaterlinkJsonParser().feed(
        encode_waterlink_json(velocity, altitude_m, sigma, beams, *stamps), 1.0
    )
    assert (sample.velocity, sample.altitude_m, sample.sigma) == (velocity, altitude_m, sigma)
    assert sample.time_s == pytest.approx(0.95)
    (sample,) = WaterlinkSerialParser().feed(
        encode_waterlink_serial(velocity, altitude_m, sigma, beams, *stamps), 1.0
    )
    assert sample.velocity == pytest.approx(velocity, abs=0.5001e-3)
    assert (sample.altitude_m, sample.sigma) == pytest.approx((altitude_m, sigma), abs=0.5001e-2)
    assert sample.time_s == pytest.approx(0.95)


def test_a_lost_lock_is_encoded_as_the_device_writes_it():
    lost = ((NAN, NAN, NAN), NAN, NAN, (NAN, 2.0, NAN, NAN), 7, 14)
    assert b"wrz,0.000,0.000,0.000,n,-1.00," in encode_waterlink_serial(*lost)
    report = json.loads(encode_waterlink_json(*lost))
    assert (report["velocity_valid"], report["vx"], report["altitude"]) == (False, 0.0, -1.0)
    for parser, data in (
        (WaterlinkJsonParser(), encode_waterlink_json(*lost)),
        (WaterlinkSerialParser(), encode_waterlink_serial(*lost)),
    ):
        (sample,) = parser.feed(data, 0.0)
        assert not sample.locked
