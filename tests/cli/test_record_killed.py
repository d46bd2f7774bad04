"""`seatrial record` killed at any moment: what it had passed on is in its file, and the next one goes on."""

import random
import socket
import struct
import threading
from contextlib import contextmanager
from itertools import count, islice

import pytest
from fakes.ports import free_port
from fakes.processes import Running
from fakes.recordings import raws
from figures import keep
from waiting import over_and_over, until

from bridge.wire.framing import Encoder, Framer
from bridge.wire.tlog import load_bytes
from gcs_plugin.dives.folder import list_folders

SHORT, LONG = 3, 100
MOST_HEARD = 1500
PAUSE_S = 0.02
FRAMES_A_PAUSE = 20
SOON_S = 120.0


@contextmanager
def vehicle(port):
    """Sends frames that all differ, whether anybody hears them or not."""
    encoder, numbers, sock = Encoder(1, 1), count(1), socket.socket(type=socket.SOCK_DGRAM)

    def send():
        for number in islice(numbers, FRAMES_A_PAUSE):
            sock.sendto(encoder.frame(2, struct.pack("<QI", 1, number)), ("127.0.0.1", port))

    with sock, over_and_over(send, PAUSE_S):
        yield


class Killed:
    """A recorder, killed a moment after it had passed on `most` frames; `heard` are all that it passed on."""

    def __init__(self, folder, link, hub, most, moment_s):
        self.heard, framer = [], Framer()
        recorder = Running("record", "--link", link, "--hub", str(hub), "--out", str(folder))
        try:
            client = until(lambda: self._connected(hub, recorder.process), SOON_S) if most else None
            while len(self.heard) < most:
                data = client.recv(1 << 16)
                assert data, "the recorder has ended by itself"
                self.heard += framer.feed(data)
            threading.Event().wait(moment_s)
            assert recorder.process.poll() is None, "the recorder has ended by itself"
        finally:
            recorder.kill()
        if client is not None:
            self.heard += framer.feed(self._rest(client))
            client.close()

    @staticmethod
    def _connected(port, recorder):
        assert recorder.poll() is None, "the recorder has ended by itself"
        try:
            return socket.create_connection(("127.0.0.1", port), SOON_S)
        except ConnectionRefusedError:
            return None

    @staticmethod
    def _rest(client):
        """The bytes under way when it died."""
        under_way = b""
        try:
            while data := client.recv(1 << 16):
                under_way += data
        except ConnectionResetError:
            pass
        return under_way


def kill_over_and_over(root, times, seed):
    """Frames that were passed on, over `times` kills at moments drawn by `seed`; all of them are found again."""
    rng, passed_on, finished = random.Random(seed), 0, {}
    port, hub = free_port(socket.SOCK_DGRAM), free_port(socket.SOCK_STREAM)
    with vehicle(port):
        for kill in range(times):
            # Where none needs to be heard it may be killed as it starts.
            most = 0 if kill % 10 == 9 else rng.randint(1, MOST_HEARD)
            moment_s = rng.uniform(0.0, PAUSE_S if most else 1.0)
            killed = Killed(root, f"udpin:127.0.0.1:{port}", hub, most, moment_s)
            begun = [folder for folder in list_folders(root) if folder.path not in finished]
            if most:
                (folder,) = begun
                kept = raws(*folder.telemetry())
                heard = [frame.raw for frame in killed.heard]
                assert heard[0] in kept, f"kill {kill} of seed {seed}"
                first = kept.index(heard[0])
                assert kept[first : first + len(heard)] == heard, f"kill {kill} of seed {seed}"
            passed_on += len(killed.heard)
            for folder in begun:
                finished[folder.path] = [load_bytes(path) for path in folder.telemetry()]
    for path, kept in finished.items():
        assert [load_bytes(file) for file in sorted(path.glob("*.tlog"))] == kept, (
            "a later start has touched it"
        )
    return passed_on


def test_what_a_recorder_had_passed_on_survives_a_kill_and_the_next_start_goes_on(tmp_path):
    assert kill_over_and_over(tmp_path, SHORT, 0) > SHORT


@pytest.mark.soak
def test_what_a_recorder_had_passed_on_survives_a_hundred_kills(tmp_path):
    passed_on = kill_over_and_over(tmp_path, LONG, 1)
    keep("recorder_killed", f"{passed_on} frames passed on before {LONG} kills, none of them lost")
