"""The page's server: who may connect, how many, and what is said before a socket is opened."""

import asyncio
import socket

import pytest
from aiohttp import ClientSession, WSServerHandshakeError

from bridge.errors import LinkError
from bridge.links.addresses import is_loopback
from tui.web.server import PageServer, in_url, refusal, warning

NAME, SITE = "does not answer to the name", "may not connect here; open http://localhost:8000/"


@pytest.mark.parametrize(
    ("host", "origins", "why"),
    [
        *((host, (None, f"http://{host}"), "") for host in
          ("127.0.0.1:8000", "localhost:8000", "[::1]:8000", "192.168.2.2", "boat", "blueos.local:44001", "pi.lan")),
        ("boat.example.org:8000", (None,), ""),
        *((host, (None, f"http://{host}"), NAME) for host in
          ("evil.example", "evil.example:8000", "", "[::1", "localhost.evil.example")),
        ("localhost:8000", ("https://evil.example", "http://localhost:9", "null", "", "http://["), SITE),
    ],
    ids=str,
)  # fmt: skip
def test_addresses_local_names_and_its_own_are_answered_and_neither_a_bought_name_nor_another_site(
    host, origins, why
):
    for origin in origins:
        refused = refusal(host, origin, "boat.example.org")
        assert (why in refused) if why else refused == ""


def test_only_loopback_needs_no_warning():
    hosts = ("localhost", "127.0.0.1", "::1", "0.0.0.0", "boat")
    assert list(filter(is_loopback, hosts)) == ["localhost", "127.0.0.1", "::1"]
    assert warning("127.0.0.1", control=True) == ""
    assert warning("0.0.0.0", control=False).startswith("anyone who reaches 0.0.0.0 sees all of this")
    assert "all that the crew can" in warning("0.0.0.0", control=True)


def test_an_address_in_a_url_can_be_opened_here():
    addresses = ("127.0.0.1", "0.0.0.0", "::", "fe80::1")
    assert [in_url(address) for address in addresses] == ["127.0.0.1", "127.0.0.1", "[::1]", "[fe80::1]"]


def served(work, most=1):
    """Serve a page whose app never says a word, and do `work` with its address."""

    async def scene():
        listening = asyncio.get_running_loop().create_future()
        server = PageServer(["sleep", "60"], "127.0.0.1", 0, most)
        running = asyncio.ensure_future(server.run(listening.set_result))
        ((host, port),) = await listening
        async with ClientSession() as session:
            try:
                await work(session, f"http://{host}:{port}")
            finally:
                running.cancel()
                await asyncio.gather(running, return_exceptions=True)

    asyncio.run(scene())


def test_the_page_names_no_address_but_its_own_and_lets_nothing_else_in():
    async def work(session, address):
        async with session.get(address) as answer:
            text = await answer.text()
            assert answer.headers["Content-Security-Policy"].startswith("default-src 'self'")
        assert "http://" not in text
        assert "https://" not in text
        assert 'src="static/js/textual.js"' in text

    served(work)


@pytest.mark.parametrize("headers", [{"Host": "evil.example"}, {"Origin": "https://evil.example"}])
def test_strangers_get_neither_page_nor_web_socket(headers):
    async def work(session, address):
        async with session.get(address, headers=headers) as answer:
            assert answer.status == 403
        with pytest.raises(WSServerHandshakeError) as refused:
            await session.ws_connect(f"{address}/ws", headers=headers)
        assert refused.value.status == 403

    served(work)


def test_a_browser_too_many_is_refused():
    async def work(session, address):
        with pytest.raises(WSServerHandshakeError) as refused:
            await session.ws_connect(f"{address}/ws")
        assert refused.value.status == 503

    served(work, most=0)


def test_a_port_that_is_taken_is_said():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        server = PageServer(["true"], "127.0.0.1", port)
        with pytest.raises(LinkError, match=f"can't be served on 127.0.0.1 port {port}: .*; give another"):
            asyncio.run(server.run(lambda _: None))
