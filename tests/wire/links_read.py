"""Bytes read from a link until as many have come as are asked for."""

from bridge.links.link import Link

SOON_S = 30.0


def read_exactly(link: Link, count: int) -> bytes:
    data = b""
    while len(data) < count:
        more = link.read(SOON_S)
        assert more, f"only {data!r} came"
        data += more
    return data
