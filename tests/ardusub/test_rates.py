"""The requests for an autopilot's messages, on links that are slow or lose."""

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.firmware.ardusub import ARDUSUB
from bridge.firmware.rates import Rates

IDS = list(ARDUSUB.rates_hz)


def denied_by(sends, delay_s, lost=()):
    """The ids that pass for denied where the answers come late; `sends`: the ids that the autopilot has."""
    rates, on_the_way, asked = Rates(1, ARDUSUB, (1, 191)), [], 0
    for step in range(4000):
        now_s = 0.02 * step
        for message in rates.step(now_s, has_stream=True):
            asked += 1
            if asked not in lost:
                known = int(message.param1) in sends
                result = dialect.MAV_RESULT_ACCEPTED if known else dialect.MAV_RESULT_DENIED
                answer = dialect.MAVLink_command_ack_message(message.command, result, 0, 0, 1, 191)
                on_the_way.append((now_s + delay_s, answer))
        while on_the_way and on_the_way[0][0] <= now_s:
            rates.on_ack(on_the_way.pop(0)[1], now_s)
    assert rates.settled
    return rates.denied


def test_a_denial_that_comes_twice_and_late_is_not_taken_for_that_of_the_next_message():
    for delay_s in (0.1, 1.3, 2.4):
        assert denied_by(IDS[1:], delay_s) == {IDS[0]}


def test_a_request_that_is_lost_is_sent_again():
    assert denied_by(IDS[1:], 0.1, lost=(1, 3, 4)) == {IDS[0]}
