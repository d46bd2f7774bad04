"""What in a segment no checksum of a frame speaks for: only the vehicle can tell whether it has the same there."""

from collections import Counter

from bridge.tlog import STAMP_BYTES, next_record

Stretch = tuple[int, int]
"""Where it begins, and how many bytes it has."""


def doubtful(data: bytes) -> list[Stretch]:
    """What is no intact record, in its order: damage, stamps that can be none, and frames of a kind that nobody knows.

    A ring writes whole records in a row, so that most segments have none.
    """
    found: list[Stretch] = []
    position, passed = 0, Counter[str]()
    while (record := next_record(data, position, passed)) is not None:
        end, stamp_us, frame = record
        begins = end - len(frame.raw) - (0 if stamp_us is None else STAMP_BYTES)
        sound = begins if frame.known else end
        if sound > position:
            found.append((position, sound - position))
        position = end
    if position < len(data):
        found.append((position, len(data) - position))
    return found


def damaged_before(data: bytes) -> list[int]:
    """Before which of its intact records, by their number from 0, something is damaged; how many there are where it is
    the end that is. What was only cut is no damage."""
    found: list[int] = []
    position, number, counts = 0, 0, Counter[str]()
    while True:
        known = counts["checksum"]
        record = next_record(data, position, counts)
        found += [number] * (counts["checksum"] - known)
        if record is None:
            return found
        position, number = record[0], number + 1
