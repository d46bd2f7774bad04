"""The state of a running recording, for tests of the verbs that use its hub."""

import os

from bridge import clock
from gcs_plugin.recording.state import Holding

LINK = "udpin:127.0.0.1:14550"
HUB = "tcp:127.0.0.1:4711"


def telling(**changed):
    """The state of a recording of this process, written now; some of it `changed`."""
    state = {
        "pid": os.getpid(), "hub": HUB, "links": (LINK,), "folder": "/dives/a", "began_utc": "2026-11-20T09:12:03Z",
        "frames": 0, "bytes": 0, "lost": 0, "disk_left_s": 1.0, "notices": (),
        "written_unix_s": clock.SystemClock().unix_s(),
    }  # fmt: skip
    return Holding(**state | changed)
