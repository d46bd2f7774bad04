"""Run a `Fetching` over a link: this module reads, writes and times out; the protocol is in `fetching`."""

from collections.abc import Callable
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import LinkError, LinkTimeout
from bridge.framing import Encoder, Framer
from bridge.ftp.packet import decode
from bridge.link.base import Link
from gcs_plugin.fetch.fetching import Fetching
from gcs_plugin.peers import GROUND_STATION, ground_heartbeat

POLL_S: Final = 0.01
BEAT_EVERY_S: Final = 1.0
TELL_EVERY_S: Final = 0.2
_FTP: Final[int] = dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL
_TARGET_BYTES: Final = 3  # network, system, component


def fetch(
    link: Link,
    clock: Clock,
    fetching: Fetching,
    vehicle: tuple[int, int],
    patience_s: float,
    progress: Callable[[Fetching], None],
) -> None:
    """Drive `fetching` over `link` until it is done. Every wait is a read of the link with a timeout.

    Raises LinkTimeout if the vehicle gives no useful answer for `patience_s`, and LinkError if it can't deliver. The
    bytes fetched so far are kept, and the next fetch resumes after them.
    """
    encoder, framer = Encoder(*GROUND_STATION), Framer()
    beat_s = report_s = clock.boot_s()
    while not fetching.done:
        now_s = clock.boot_s()
        out = [encoder.frame(_FTP, bytes((0, *vehicle)) + packet.encode()) for packet in fetching.tick(now_s)]
        if now_s >= beat_s:
            beat_s = now_s + BEAT_EVERY_S
            out.append(encoder.encode(ground_heartbeat()))
        if out:
            link.write(b"".join(out))
        for frame in framer.feed(link.read(POLL_S)):
            if frame.message_id != _FTP or (frame.system, frame.component) != vehicle:
                continue
            target, payload = frame.payload[:_TARGET_BYTES], frame.payload[_TARGET_BYTES:]
            if target == bytes((0, *GROUND_STATION)):
                fetching.on_packet(decode(payload), clock.boot_s())
        if clock.boot_s() >= report_s:
            report_s = clock.boot_s() + TELL_EVERY_S
            progress(fetching)
        if clock.boot_s() - fetching.heard_s > patience_s:
            raise LinkTimeout(
                f"{link.name}: the vehicle has answered nothing for {patience_s:.0f} s; what was fetched is kept, "
                "fetch again and it goes on from there"
            )
    if fetching.fault:
        raise LinkError(fetching.fault)
