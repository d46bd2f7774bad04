"""Frames that the disk did not take in one dive lie in the next, and stay there though nothing else comes."""

from faked_ground import Disk, Ground, frames_of
from fakes.recordings import raws

from gcs_plugin.dives.folder import About
from gcs_plugin.dives.recorded_dives import RecordedDives


def test_a_silent_dive_that_took_over_frames_of_the_one_before_is_kept(tmp_path):
    ground, sent, over = Ground(Disk()), frames_of(20), []
    dives = RecordedDives(tmp_path / "dives", "", lambda _: About(), ground.clock)
    ground.disk.full, ground.disk.free = True, 0
    for raw in sent:
        ground.hear(raw)
    dives.go_on(ground.recorder, over.append)
    ground.hear(b"")
    ground.recorder.close()
    last = dives.end(ground.recorder.count)
    assert (len(over), last.count.frames, last.count.lost) == (1, 20, 0)
    assert last.folder is not None
    assert raws(last.folder / "telemetry.tlog") == sent
