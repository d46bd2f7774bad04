"""The service that BlueOS talks to: it answers `GET /register_service`, and passes everything else to the page.

    service.py --port 80 --page 8000 COMMAND...

Starts COMMAND, which serves the page on the loopback port `--page` of this container, and ends with it. If its link did
not work, COMMAND is started again, since BlueOS may start extensions before its MAVLink endpoints. A connection is
passed on whole, after a look at its first line, so that the page's web sockets work as well. Standard library alone.
"""

import argparse
import asyncio
import contextlib
import signal
import sys
from collections.abc import Coroutine, Sequence
from pathlib import Path
from typing import Final

LOOPBACK: Final = "127.0.0.1"
EVERYWHERE: Final = "0.0.0.0"
"""Of the container, which is reached from outside by the port that BlueOS binds alone."""
ANSWER: Final = Path(__file__).with_name("register_service.json")
ASKED: Final = "/register_service"
LONGEST_LINE: Final = 8192
FIRST_LINE_S: Final = 10.0
CHUNK: Final = 65536
NO_LINK: Final = 3
"""Exit code of seatrial if a link does not work."""
AGAIN_S: Final = 5.0


def response(status: str, kind: str, body: bytes) -> bytes:
    """A whole HTTP answer, after which the connection is closed."""
    head = f"HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\nConnection: close\r\n\r\n"
    return head.encode("ascii") + body


def is_registration(line: bytes) -> bool:
    """Whether a request's first line asks who this is."""
    words = line.decode("latin-1").split()
    return len(words) == 3 and words[0] == "GET" and words[1].split("?")[0] == ASKED


class Front:
    """Serves `port` of every interface, and passes on to `page`."""

    def __init__(self, page: int) -> None:
        self._page = page

    async def serve(self, port: int, host: str = EVERYWHERE) -> asyncio.Server:
        """Listen; port 0 is any that is free."""
        return await asyncio.start_server(self._handle, host, port, limit=LONGEST_LINE)

    async def _handle(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        # Closed also where the whole service ends meanwhile.
        with contextlib.closing(writer), contextlib.suppress(OSError):
            try:
                line = await asyncio.wait_for(reader.readuntil(b"\n"), FIRST_LINE_S)
            except (asyncio.IncompleteReadError, asyncio.LimitOverrunError, TimeoutError):
                writer.write(response("400 Bad Request", "text/plain", b"no HTTP request\n"))
            else:
                if is_registration(line):
                    writer.write(response("200 OK", "application/json", ANSWER.read_bytes()))
                else:
                    await self._pass_on(line, reader, writer)
            await writer.drain()

    async def _pass_on(self, line: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            page_reader, page_writer = await asyncio.open_connection(LOOPBACK, self._page)
        except OSError:
            words = b"seatrial's page is not up yet; try again in a moment\n"
            writer.write(response("503 Service Unavailable", "text/plain", words))
            return
        page_writer.write(line)
        there = asyncio.ensure_future(_copy(reader, page_writer))
        try:
            await _copy(page_reader, writer)
        finally:
            there.cancel()
            page_writer.close()


async def _copy(source: asyncio.StreamReader, target: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while data := await source.read(CHUNK):
            target.write(data)
            await target.drain()
    # An end that is an error is one too: who waits on the other side would wait for ever.
    with contextlib.suppress(OSError):
        if target.can_write_eof():
            target.write_eof()


async def run(
    port: int, page: int, command: Sequence[str], host: str = EVERYWHERE, again_s: float = AGAIN_S
) -> int:
    """Serve until `command` ends for another reason than its link; its exit code."""
    server = await Front(page).serve(port, host)
    where = "every network of this container" if host == EVERYWHERE else f"the network of {host}"
    for listening in server.sockets:
        number = listening.getsockname()[1]
        sys.stderr.write(
            f"open: {host} port {number} (TCP): the page, for BlueOS and browsers, reachable from {where}\n"
        )
    sys.stderr.flush()
    async with server:
        while (code := await _done(command)) == NO_LINK:
            await asyncio.sleep(again_s)
        return code


async def _done(command: Sequence[str]) -> int:
    process = await asyncio.create_subprocess_exec(*command)
    try:
        return await process.wait()
    finally:
        if process.returncode is None:
            process.terminate()
            await process.wait()


def main(words: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description="Answers BlueOS and passes on to seatrial's page.")
    parser.add_argument("--port", type=int, default=80, help="where BlueOS and browsers come")
    parser.add_argument(
        "--page", type=int, default=8000, help="the loopback port on which COMMAND serves the page"
    )
    parser.add_argument("command", nargs=argparse.REMAINDER, metavar="COMMAND")
    arguments = parser.parse_args(words)
    if not arguments.command:
        parser.error("give the COMMAND that serves the page")
    with contextlib.suppress(asyncio.CancelledError):
        return asyncio.run(_until_told(run(arguments.port, arguments.page, arguments.command)))
    return 0


async def _until_told(work: Coroutine[None, None, int]) -> int:
    """A container's first process hears of its end only by a handler of its own."""
    ends = asyncio.ensure_future(work)
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, ends.cancel)
    return await ends


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
