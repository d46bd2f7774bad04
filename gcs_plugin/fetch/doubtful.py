"""Find the bytes of a segment that no frame's checksum confirms: only the vehicle can say whether it has the same."""

from collections import Counter

from bridge.tlog import STAMP_BYTES, next_record

Stretch = tuple[int, int]
"""Offset and length in bytes."""


def doubtful(data: bytes) -> list[Stretch]:
    """Return all stretches that are no intact records, by offset: damage, impossible stamps, unknown frame types.

    A ring writes complete records back to back, so most segments have no such stretch.
    """
    stretches: list[Stretch] = []
    position, passed = 0, Counter[str]()
    while (record := next_record(data, position, passed)) is not None:
        end, stamp_us, frame = record
        frame_begins = end - len(frame.raw) - (0 if stamp_us is None else STAMP_BYTES)
        intact_from = frame_begins if frame.known else end
        if intact_from > position:
            stretches.append((position, intact_from - position))
        position = end
    if position < len(data):
        stretches.append((position, len(data) - position))
    return stretches


def damaged_before(data: bytes) -> list[int]:
    """For each damaged place, return the number, from 0, of the intact record after it.

    For damage at the end this is the number of all records. A file that was only cut off counts as undamaged.
    """
    numbers: list[int] = []
    position, number, counts = 0, 0, Counter[str]()
    while True:
        known = counts["checksum"]
        record = next_record(data, position, counts)
        numbers += [number] * (counts["checksum"] - known)
        if record is None:
            return numbers
        position, number = record[0], number + 1
