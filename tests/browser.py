"""A headless Chromium by its DevTools protocol; its terminal is read as a person would, selected and copied."""

import asyncio
import contextlib
import shutil
import time

from aiohttp import ClientSession

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
PATIENCE_S = 60.0
SHIFT = 8
COPIED = """
(() => {
  const event = new ClipboardEvent("copy", {clipboardData: new DataTransfer(), bubbles: true, cancelable: true});
  document.querySelector(".xterm").dispatchEvent(event);
  return event.clipboardData.getData("text/plain");
})()
"""


class Browser:
    """One page. `requests` are the addresses of all that it asked for."""

    def __init__(self, socket, width, height):
        self._socket, self._width, self._height = socket, width, height
        self._number, self.requests = 0, []

    async def call(self, method, **parameters):
        """What DevTools answers to one command."""
        self._number += 1
        await self._socket.send_json({"id": self._number, "method": method, "params": parameters})
        while True:
            answer = await self._socket.receive_json(timeout=PATIENCE_S)
            if answer.get("method") == "Network.requestWillBeSent":
                self.requests.append(answer["params"]["request"]["url"])
            if answer.get("method") == "Network.webSocketCreated":
                self.requests.append(answer["params"]["url"])
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]

    async def evaluate(self, expression):
        answer = await self.call("Runtime.evaluate", expression=expression)
        return answer["result"].get("value")

    async def key(self, key, code, *, ctrl=False):
        for kind in ("rawKeyDown", "keyUp"):
            await self.call(
                "Input.dispatchKeyEvent",
                type=kind,
                key=key,
                windowsVirtualKeyCode=code,
                modifiers=2 if ctrl else 0,
            )

    async def words(self):
        """The terminal's text: with Shift, so that the terminal selects, and the app hears no mouse."""
        ends = ((1, 1), (self._width - 2, self._height - 2))
        for kind, (x, y) in zip(
            ("mousePressed", "mouseMoved", "mouseReleased"), (*ends, ends[1]), strict=True
        ):
            await self.call(
                "Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1, modifiers=SHIFT
            )
        return await self.evaluate(COPIED) or ""

    async def until(self, *words, without=()):
        """The terminal's text once all `words` are on it."""
        until_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < until_s:
            seen = await self.words()
            if all(word in seen for word in words) and not any(word in seen for word in without):
                return seen
            await asyncio.sleep(0.1)
        raise AssertionError(f"{words} not seen within {PATIENCE_S:.0f} s:\n{seen}")

    async def until_true(self, expression):
        """Wait for it, without a click."""
        until_s = time.monotonic() + PATIENCE_S
        while not await self.evaluate(expression):
            assert time.monotonic() < until_s, f"{expression} is not true within {PATIENCE_S:.0f} s"
            await asyncio.sleep(0.1)


@contextlib.asynccontextmanager
async def opened(address, folder, width=1280, height=800):
    """A browser that has the page of `address` open; its profile lies in `folder`."""
    process = await asyncio.create_subprocess_exec(
        CHROMIUM,
        "--headless=new",
        "--no-sandbox",
        "--disable-dev-shm-usage",
        "--no-first-run",
        "--disable-background-networking",
        f"--window-size={width},{height}",
        f"--user-data-dir={folder}",
        "--remote-debugging-port=0",
        "about:blank",
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.DEVNULL,
    )
    try:
        port = await _port(folder / "DevToolsActivePort", process)
        async with ClientSession() as session:
            async with session.get(f"http://127.0.0.1:{port}/json/list") as answer:
                (page,) = [target for target in await answer.json() if target["type"] == "page"]
            async with session.ws_connect(page["webSocketDebuggerUrl"], max_msg_size=0) as socket:
                browser = Browser(socket, width, height)
                for domain in ("Page", "Network", "Runtime"):
                    await browser.call(f"{domain}.enable")
                size = {"width": width, "height": height}
                await browser.call(
                    "Emulation.setDeviceMetricsOverride", **size, deviceScaleFactor=1, mobile=False
                )
                await browser.call("Page.navigate", url=address)
                yield browser
    finally:
        if process.returncode is None:
            process.terminate()
        await process.wait()


async def _port(file, process):
    """The port that Chromium chose, once it has written it down."""
    until_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < until_s:
        assert process.returncode is None, f"{CHROMIUM} ended with {process.returncode}"
        if file.exists() and (lines := file.read_text(encoding="ascii").splitlines()):
            return int(lines[0])
        await asyncio.sleep(0.05)
    raise AssertionError(f"{CHROMIUM} opened no port within {PATIENCE_S:.0f} s")
