"""A table that `rostopic echo -p` writes is read by the stamps in its messages, not by when it got them."""

import numpy as np
import pytest
from turning_vehicle import readings

from identify.ingest.files.text_table import read_table
from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.mapping.signals import dive_fields

READ = readings()
START_NS = 1_669_909_200_000_000_000


def written(path, stamp_ns):
    """The table of a topic whose messages arrive in bursts, a second long."""
    time_ns = START_NS + np.round(1e9 * READ["t"]).astype(np.int64)
    got_ns = START_NS + 1_000_000_000 * np.ceil(READ["t"] + 1e-9).astype(np.int64)
    stamps = time_ns if stamp_ns is None else np.full(len(time_ns), stamp_ns)
    rows = zip(got_ns, stamps, *READ["velocity"].T, *READ["euler"].T, strict=True)
    names = [
        "%time", "field.header.stamp",
        *(f"field.{of}.{axis}" for of in ("velocity", "orientation") for axis in "xyz"),
    ]  # fmt: skip
    path.write_text("\n".join([",".join(names), *(",".join(map(str, row)) for row in rows)]))
    return path


def test_a_table_of_a_topic_is_read_by_the_stamps_in_its_messages(tmp_path):
    path = written(tmp_path / "state.csv", None)
    streams = read_table(path)
    proposal = propose(streams.streams, path)
    assert (proposal.columns.time.column, proposal.columns.time.unit) == ("field.header.stamp", "ns")
    velocity = dive_fields(streams, proposal.columns, path)["velocity"]
    assert np.diff(velocity.time_s) == pytest.approx(np.diff(READ["t"]), abs=1e-6)


def test_a_stamp_that_nothing_fills_is_no_time(tmp_path):
    path = written(tmp_path / "state.csv", 0)
    assert propose(read_table(path).streams, path).columns.time.column == "time"
