"""The app in a browser: textual-serve's page, with ours, announced sockets, and protection from foreign pages.

A page on the internet may open a web socket to this computer from a visitor's browser, and may give its own name this
computer's address (DNS rebinding). The first shows in `Origin`, the second in a `Host` name that can be registered.
"""

import asyncio
import contextlib
import ipaddress
import shlex
import signal
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from aiohttp import web
from textual_serve.server import Server

from bridge.errors import LinkError
from bridge.links.addresses import is_loopback

PAGE: Final = Path(__file__).with_name("page")
MOST_VISITORS: Final = 4
"""Each visitor is a process of its own, of 100 MB and a few per cent of a core."""
ENDING_S: Final = 2.0
POLICY: Final = (
    "default-src 'self'; script-src 'self' 'unsafe-inline'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self' ws: wss:; frame-ancestors 'self'"
)
"""Nothing is loaded from the internet, and no other site may frame the page."""
LOCAL_NAMES: Final = ("localhost", "local", "internal", "lan")
"""Names with these endings are given by this computer, mDNS or a router; no registrar sells them."""


class PageServer(Server):
    """Runs `command` for each browser, up to `most` at a time."""

    def __init__(self, command: Sequence[str], host: str, port: int, most: int = MOST_VISITORS) -> None:
        super().__init__(shlex.join(command), host, port, "seatrial", templates_path=PAGE)
        self._most, self._visitors = most, 0

    async def run(self, tell: Callable[[list[tuple[str, int]]], None]) -> None:
        """Serve until SIGINT or SIGTERM; `tell` gets the sockets once they are open. Raises LinkError."""
        runner = web.AppRunner(await self._make_app(), shutdown_timeout=ENDING_S)
        ended = asyncio.Event()
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            with contextlib.suppress(NotImplementedError):  # Windows, where SIGINT raises KeyboardInterrupt
                loop.add_signal_handler(number, ended.set)
        await runner.setup()
        try:
            try:
                await web.TCPSite(runner, self.host, self.port).start()
            except OSError as error:
                raise LinkError(
                    f"the page can't be served on {self.host} port {self.port}: {error.strerror}; "
                    "give another --host or --port"
                ) from error
            tell([(address[0], address[1]) for address in runner.addresses])
            await ended.wait()
        finally:
            await runner.cleanup()

    async def on_startup(self, app: web.Application) -> None:
        app.on_response_prepare.append(_guard)

    async def handle_index(self, request: web.Request) -> web.StreamResponse:
        self._check(request)
        return await super().handle_index(request)

    async def handle_websocket(self, request: web.Request) -> web.WebSocketResponse:
        self._check(request)
        if self._visitors >= self._most:
            raise web.HTTPServiceUnavailable(
                text=f"{self._most} browsers look already; close the page in one\n"
            )
        self._visitors += 1
        try:
            return await super().handle_websocket(request)
        finally:
            self._visitors -= 1

    def _check(self, request: web.Request) -> None:
        why = refusal(request.headers.get("Host", ""), request.headers.get("Origin"), self.host)
        if why:
            raise web.HTTPForbidden(text=f"{why}\n")


async def _guard(_: web.Request, response: web.StreamResponse) -> None:
    response.headers["Content-Security-Policy"] = POLICY


def refusal(host: str, origin: str | None, served: str) -> str:
    """Reason to refuse a request with these headers, "" to accept it; `served` is the host given for the page."""
    name = _name(host)
    if not (_is_local(name) or name == served.lower()):
        return (
            f"this page does not answer to the name '{name}'; open it by its address, or by a name in .local"
        )
    if origin is not None and _netloc(origin) != host.lower():
        return f"the page of {origin} may not connect here; open http://{host}/ itself"
    return ""


def warning(host: str, control: bool) -> str:
    """The warning about an address before it is opened; "" for loopback."""
    if is_loopback(host):
        return ""
    if control:
        return (
            f"anyone who reaches {host} can do from the page all that the crew can: nobody is asked for a password, "
            "and nothing is encrypted"
        )
    return f"anyone who reaches {host} sees all of this: nobody is asked for a password, and nothing is encrypted"


def in_url(address: str) -> str:
    """An address as written in a URL; the wildcard addresses become loopback."""
    if address in ("0.0.0.0", "::"):
        return "127.0.0.1" if address == "0.0.0.0" else "[::1]"
    return f"[{address}]" if ":" in address else address


def _name(host: str) -> str:
    """A `Host` header without its port."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _netloc(origin: str) -> str:
    """Host and port of an `Origin` header; "" for one that is no address."""
    try:
        return urlsplit(origin).netloc.lower()
    except ValueError:
        return ""


def _is_local(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return bool(name) and ("." not in name or name.rpartition(".")[2] in LOCAL_NAMES)
    return True
