"""Bytes read from a link until as many have come as are asked for, and a port that nobody holds."""

import socket

from bridge.links.link import Link

SOON_S = 30.0


def read_exactly(link: Link, count: int) -> bytes:
    data = b""
    while len(data) < count:
        more = link.read(SOON_S)
        assert more, f"only {data!r} came"
        data += more
    return data


def free_port(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as sock:
        sock.bind(("127.0.0.1", 0))
        return int(sock.getsockname()[1])
