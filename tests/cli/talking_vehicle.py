"""A vehicle that sends numbered frames over TCP, for tests of recorders in processes of their own."""

import socket
import threading
from contextlib import suppress

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.wire.framing import Encoder


class TalkingVehicle:
    """Sends frames that all differ to whoever connects, one every 2 ms, until it is told to stop."""

    def __init__(self):
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(120.0)
        self.link = f"tcp:127.0.0.1:{self._listener.getsockname()[1]}"
        self.sent = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        encoder = Encoder(1, 1)
        # Nobody may come, and who comes may leave before it is told to stop.
        with suppress(OSError), self._listener.accept()[0] as peer:
            while not self._stop.wait(0.002):
                raw = encoder.encode(dialect.MAVLink_system_time_message(1, 1000 + len(self.sent)))
                peer.sendall(raw)
                self.sent.append(raw)

    def close(self):
        self._stop.set()
        self._thread.join()
        self._listener.close()
