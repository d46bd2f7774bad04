"""A fake vehicle behind whatever link a command opens, and the death of the command as it sends a message."""

from contextlib import contextmanager

from fakes.vehicle import FakeVehicle

from bridge.wire.framing import Framer, decode


def at_any_link(monkeypatch, store=None):
    """A vehicle at the end of whatever link is opened from now on."""
    vehicle = FakeVehicle(store=store)
    put_at_any_link(monkeypatch, vehicle)
    return vehicle


def put_at_any_link(monkeypatch, vehicle):
    """Whatever link is opened from now on leads to that vehicle, and goes by its clock."""
    monkeypatch.setattr("bridge.links.open.open_link", lambda _: vehicle)
    monkeypatch.setattr("bridge.clock.SystemClock", lambda: vehicle.clock)


class GroundKilledError(BaseException):
    """Stands in for a kill: nothing catches it."""


@contextmanager
def dying_at(vehicle, message, kinds=()):
    """Within the block, the ground dies as it sends its `message`-th message of these kinds, or of any.

    Yields the list of the kinds that it sent.
    """
    write, sent = vehicle.write, []

    def dies(data):
        messages = [decode(frame).get_type() for frame in Framer().feed(data)]
        sent.extend(kind for kind in messages if not kinds or kind in kinds)
        if len(sent) >= message:
            raise GroundKilledError
        write(data)

    vehicle.write = dies
    try:
        yield sent
    finally:
        vehicle.write = write
