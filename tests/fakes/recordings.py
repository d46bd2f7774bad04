"""Contents of recordings."""

from bridge.wire.segments import segments_in
from bridge.wire.tlog import each_nonempty, read_tlog


def raws(*files):
    """The frames of recordings, one after the other; files that hold none are left out."""
    begun = [file for file in files if file.stat().st_size]
    return [frame.raw for records in each_nonempty(begun, read_tlog) for _, frame in records]


def ring_raws(folder):
    """The frames of a ring, oldest first."""
    return raws(*(folder / segment.name for segment, _ in segments_in(folder)))
