"""DIVES of a command line to recordings: each once, in whatever way it was given."""

import gzip

import batch_jobs
import pytest

from bridge.clock import date_in_name
from bridge.errors import LogError
from identify.batch.jobs import Recording
from identify.batch.recordings import distinct_names, find_recordings, name_of
from identify.words import utc


def put(path, data):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path


@pytest.fixture
def dives(tmp_path):
    root = tmp_path / "dives"
    put(root / "2026-11-20T0912Z-hovering" / "telemetry.tlog", b"a")
    put(root / "2026-11-20T0912Z-hovering" / "telemetry.2.tlog", b"b")
    put(root / "2026-11-20T0912Z-hovering" / "dive.yaml", b"notes: none")
    put(root / "lake" / "1.BIN", b"c")
    put(root / "lake" / "2.tlog.gz", b"d")
    put(root / "lake" / "table.csv", b"time_s")
    put(root / ".trash" / "old.tlog", b"e")
    return root


def names(batch):
    return sorted(recording.name for recording in batch.recordings)


def twins(batch):
    """The recording that counts in place of each that does not."""
    return {twin.path: twin.counted for twin in batch.twins}


def test_a_folder_gives_its_dive_folders_and_recordings_but_no_stray_table(dives):
    result = find_recordings([str(dives)])
    assert names(result) == ["1", "2", "2026-11-20T0912Z-hovering"]
    (folder,) = (r for r in result.recordings if r.path.is_dir())
    assert [file.name for file in folder.files] == ["telemetry.tlog", "telemetry.2.tlog"]


@pytest.mark.parametrize(
    ("word", "named"),
    [("lake/table.csv", "table"), ("2026-*", "2026-11-20T0912Z-hovering"), ("**/*.gz", "2")],
)
def test_a_named_table_counts_and_a_pattern_gives_what_it_matches(dives, word, named):
    assert names(find_recordings([str(dives / word)])) == [named]


def test_the_same_bytes_count_once_compressed_or_not_and_the_dive_folder_is_the_one(dives):
    copies = put(dives / "copy.tlog", b"ab"), put(dives / "folded.tlog.gz", gzip.compress(b"ab"))
    result = find_recordings([*map(str, copies), str(dives), str(dives / "lake")])
    assert names(result) == ["1", "2", "2026-11-20T0912Z-hovering"]
    again = {path: path for path in (dives / "lake" / "1.BIN", dives / "lake" / "2.tlog.gz")}
    assert twins(result) == again | dict.fromkeys(copies, dives / "2026-11-20T0912Z-hovering")


LONG = bytes(range(256)) * (512)


def test_of_copies_that_were_cut_only_the_longest_counts(tmp_path):
    whole = put(tmp_path / "whole.tlog.gz", gzip.compress(LONG))
    cut = put(tmp_path / "a" / "telemetry.tlog", LONG[:-999]).parent
    same_cut = put(tmp_path / "b.tlog", LONG[:-999])
    shorter = put(tmp_path / "c.tlog", LONG[:-5000])
    result = find_recordings([str(tmp_path)])
    assert [recording.path for recording in result.recordings] == [whole]
    assert twins(result) == dict.fromkeys((cut, same_cut, shorter), whole)
    assert {twin.why for twin in result.twins} == {"is the beginning of"}


def test_dives_that_begin_alike_and_go_on_otherwise_all_count(tmp_path):
    put(tmp_path / "a.tlog", LONG)
    put(tmp_path / "b.tlog", LONG[:-5000] + b"another end")
    result = find_recordings([str(tmp_path)])
    assert (names(result), result.twins) == (["a", "b"], ())


@pytest.mark.parametrize("word", ["missing.tlog", "none-*.tlog", "empty"])
def test_a_word_that_means_no_recording_is_an_error_that_names_it(tmp_path, monkeypatch, word):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(LogError, match=word.replace("*", r"\*")):
        find_recordings([word])


def test_a_recording_that_can_not_be_read_is_a_failure_of_its_own(dives):
    (dives / "gone.tlog").symlink_to(dives / "nowhere.tlog")
    result = find_recordings([str(dives)])
    assert len(result.recordings) == 3
    (failure,) = result.unreadable
    assert (failure.source, failure.final) == (str(dives / "gone.tlog"), False)
    assert "no such file" in failure.error


def test_names_lose_their_ending_and_dates_are_read_from_them(tmp_path):
    assert name_of(tmp_path / "a.tlog.gz") == "a"
    assert name_of(tmp_path / "00000042.BIN") == "00000042"
    assert utc(date_in_name("2026-11-20T0912Z-hovering")) == "2026-11-20 09:12"
    assert utc(date_in_name("2023-04-18")) == "2023-04-18 00:00"
    assert date_in_name("2023-13-18") is None
    assert utc(date_in_name("lake")) == "-"


def test_jobs_differ_by_what_their_answers_depend_on(dives):
    file = batch_jobs.FILE
    job = batch_jobs.job_on(dives / "lake" / "1.BIN", "size", file)
    assert job.key == batch_jobs.job_on(dives / "lake" / "1.BIN", "size", file).key
    others = [
        batch_jobs.job_on(dives / "lake" / "2.tlog.gz", "size", file),
        batch_jobs.job_on(dives / "lake" / "1.BIN", "meet", file),
        batch_jobs.job_on(dives / "lake" / "1.BIN", "size", batch_jobs.load_vehicle("ruvifist:survey")),
    ]
    assert len({job.key, *(other.key for other in others)}) == 4


def test_recordings_of_one_name_are_called_by_as_many_of_their_folders_as_tell_them_apart(tmp_path):
    paths = [tmp_path / way / "dive.tlog" for way in ("a/x", "b/x", "b/y")] + [tmp_path / "other.tlog"]
    recordings = [Recording(path.stem, path, (path,), str(k)) for k, path in enumerate(paths)]
    assert [distinct_name.name for distinct_name in distinct_names(recordings)] == [
        "a/x/dive",
        "b/x/dive",
        "y/dive",
        "other",
    ]


def test_a_folder_of_tables_says_how_to_name_them(tmp_path):
    (tmp_path / "b.csv").write_text("time,u")
    with pytest.raises(
        LogError, match=r"holds 1 recording that needs a column map, as b\.csv, and a folder's"
    ):
        find_recordings([str(tmp_path)])
    (tmp_path / "a.csv").write_text("time,u")
    with pytest.raises(
        LogError,
        match=r"holds 2 recordings that need a column map, as a\.csv, and a folder's other tables are no dives; name",
    ):
        find_recordings([str(tmp_path)])
