"""The BlueOS extension: its labels, its answer, its front, and a Dockerfile by the rules that need no Docker."""

import asyncio
import contextlib
import gc
import importlib.util
import json
import re
import shlex
import socket
import struct
import subprocess
import sys
import tomllib
import warnings
from pathlib import Path

import pytest
from waiting import until

from bridge import exit_codes

ROOT = Path(__file__).resolve().parents[2]
BLUEOS = ROOT / "blueos"
REPOSITORY = "owner/name"
# core/services/helper/main.py in bluerobotics/BlueOS: what must be text, and what may be there.
NEEDED = {"name", "description", "icon", "company", "version", "webpage", "api"}
MAY = {
    "route", "new_page", "extra_query", "avoid_iframes", "sanitized_name", "works_in_relative_paths", "extras",
}  # fmt: skip


def instructions():
    """(keyword, rest) of the Dockerfile, with continued lines joined and comments left out."""
    lines = (BLUEOS / "Dockerfile").read_text(encoding="utf-8").splitlines()
    text = "\n".join(line for line in lines if not line.lstrip().startswith("#"))
    joined = text.replace("\\\n", "")
    return [tuple(line.strip().split(" ", 1)) for line in joined.splitlines() if line.strip()]


def labels():
    """As Docker sets them: between single quotes nothing is replaced, between double quotes variables are."""
    results = {}
    for keyword, words in instructions():
        if keyword == "LABEL":
            key, _, value = words.partition("=")
            (plain,) = shlex.split(value)
            results[key] = plain if value.startswith("'") else plain.replace("${REPOSITORY}", REPOSITORY)
    return results


def rest_of(keyword):
    return [words for word, words in instructions() if word == keyword]


@pytest.fixture(scope="module")
def service():
    spec = importlib.util.spec_from_file_location("blueos_service", BLUEOS / "service.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_labels_are_what_the_extension_manager_reads():
    result = labels()
    assert {"version", "permissions", "authors", "company", "type", "readme", "links", "requirements"} <= set(
        result
    )
    assert all(set(author) == {"name", "email"} for author in json.loads(result["authors"]))
    assert set(json.loads(result["company"])) == {"about", "name", "email"}
    assert result["type"] in ("device-integration", "example", "tool", "other")
    tags = json.loads(result["tags"])
    assert 0 < len(tags) <= 10
    assert all(re.fullmatch(r"[a-z0-9-]+", tag) for tag in tags)
    assert result["readme"] == f"https://raw.githubusercontent.com/{REPOSITORY}/{{tag}}/blueos/README.md"
    assert json.loads(result["links"]) == {"source": f"https://github.com/{REPOSITORY}"}
    assert re.fullmatch(r"core >= \d+\.\d+", result["requirements"])


def test_the_permissions_are_those_that_the_container_needs_and_no_more():
    permissions = json.loads(labels()["permissions"])
    (exposed,) = rest_of("EXPOSE")
    assert list(permissions["ExposedPorts"]) == [exposed]
    host = permissions["HostConfig"]
    assert host["PortBindings"] == {exposed: [{"HostPort": ""}]}
    (bind,) = host["Binds"]
    assert bind.split(":")[1] == rest_of("WORKDIR")[-1]
    assert "Privileged" not in host
    assert "NetworkMode" not in host


def test_one_version_stands_everywhere():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    answer = json.loads((BLUEOS / "register_service.json").read_text(encoding="utf-8"))
    readme = (BLUEOS / "README.md").read_text(encoding="utf-8")
    assert labels()["version"] == answer["version"] == project["version"]
    assert f"seatrial:{project['version']}" in readme
    assert re.search(r"python:(\d+\.\d+)-", rest_of("FROM")[0])[1] == project["requires-python"].removeprefix(
        ">="
    )


def test_the_answer_is_one_that_blueos_takes():
    answer = json.loads((BLUEOS / "register_service.json").read_text(encoding="utf-8"))
    assert NEEDED <= set(answer) <= NEEDED | MAY
    assert all(isinstance(answer[key], str) for key in NEEDED)
    assert answer["icon"].startswith("mdi-")


def test_what_is_copied_is_there_and_what_is_installed_is_whole():
    copied = [source for words in rest_of("COPY") for source in words.split()[:-1]]
    assert all((ROOT / source).exists() for source in copied)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    packages = project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    assert set(packages) <= set(copied)
    ignored = (BLUEOS / "Dockerfile.dockerignore").read_text(encoding="utf-8").splitlines()
    assert all(f"!{source.split('/')[0]}" in ignored for source in copied)


async def asked(port, request):
    """The whole answer to a request."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(request)
    await writer.drain()
    answer = await asyncio.wait_for(reader.read(), 20.0)
    writer.close()
    return answer


def port_of(server):
    return server.sockets[0].getsockname()[1]


def test_the_front_answers_blueos_itself(service):
    async def scene():
        async with await service.Front(1).serve(0, "127.0.0.1") as server:
            return await asked(port_of(server), b"GET /register_service HTTP/1.1\r\nHost: x\r\n\r\n")

    head, _, body = asyncio.run(scene()).partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 200 OK")
    assert b"application/json" in head
    assert json.loads(body)["name"] == "seatrial"


def test_everything_else_goes_to_the_page_and_back_as_it_is(service):
    sent = b"GET /ws HTTP/1.1\r\nUpgrade: websocket\r\n\r\n" + bytes(range(256))

    async def page(reader, writer):
        got = await reader.readexactly(len(sent))
        writer.write(b"HTTP/1.1 101 Switching\r\n\r\n" + got[::-1])
        await writer.drain()
        writer.close()

    async def scene():
        behind = await asyncio.start_server(page, "127.0.0.1", 0)
        server = await service.Front(port_of(behind)).serve(0, "127.0.0.1")
        async with behind, server:
            return await asked(port_of(server), sent)

    assert asyncio.run(scene()) == b"HTTP/1.1 101 Switching\r\n\r\n" + sent[::-1]


def test_the_page_hears_of_a_browser_that_breaks_off(service):
    came, ended = asyncio.Event(), asyncio.Event()

    async def page(reader, writer):
        with contextlib.closing(writer):
            await reader.readline()
            came.set()
            await reader.read()
            ended.set()

    async def scene():
        behind = await asyncio.start_server(page, "127.0.0.1", 0)
        server = await service.Front(port_of(behind)).serve(0, "127.0.0.1")
        async with behind, server:
            _, writer = await asyncio.open_connection("127.0.0.1", port_of(server))
            writer.write(b"GET / HTTP/1.1\r\n")
            await came.wait()
            # Without lingering, its end is a reset, as where a browser's computer goes down.
            writer.get_extra_info("socket").setsockopt(
                socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0)
            )
            writer.transport.abort()
            await asyncio.wait_for(ended.wait(), 20.0)

    asyncio.run(scene())


def test_a_page_that_is_not_up_is_said(service):
    async def scene():
        # A port that is taken and does not listen: a free one could become the front's own.
        with socket.socket() as silent:
            silent.bind(("127.0.0.1", 0))
            front = service.Front(silent.getsockname()[1])
            async with await front.serve(0, "127.0.0.1") as server:
                return await asked(port_of(server), b"GET / HTTP/1.1\r\n\r\n")

    assert asyncio.run(scene()).startswith(b"HTTP/1.1 503")


def test_a_front_that_ends_while_it_passes_on_closes_all_that_it_opened(service):
    came = asyncio.Event()

    async def page(reader, writer):
        with contextlib.closing(writer):
            await reader.readline()
            came.set()
            await reader.read()

    async def scene():
        behind = await asyncio.start_server(page, "127.0.0.1", 0)
        server = await service.Front(port_of(behind)).serve(0, "127.0.0.1")
        _, writer = await asyncio.open_connection("127.0.0.1", port_of(server))
        writer.write(b"GET / HTTP/1.1\r\n")
        await came.wait()
        for item in (writer, server, behind):
            item.close()

    with warnings.catch_warnings(record=True) as raised:
        warnings.simplefilter("always")
        asyncio.run(scene())
        gc.collect()
    assert [str(item.message) for item in raised] == []


@pytest.mark.parametrize("request_", [b"x" * 20000, b"\n", b"GET /register_service\r\n"])
def test_what_is_no_request_gets_no_registration(service, request_):
    async def scene():
        async with await service.Front(1).serve(0, "127.0.0.1") as server:
            return await asked(port_of(server), request_)

    assert not asyncio.run(scene()).startswith(b"HTTP/1.1 200")


def test_it_ends_as_its_command_ends(service):
    command = [sys.executable, "-c", "raise SystemExit(4)"]
    assert asyncio.run(service.run(0, 1, command, "127.0.0.1")) == 4


def test_it_starts_again_where_the_link_did_not_work_yet(service, tmp_path):
    assert service.NO_LINK == exit_codes.LINK
    tries = tmp_path / "tries"
    program = f"f = open({str(tries)!r}, 'a+'); f.write('x'); raise SystemExit(3 if f.tell() < 3 else 0)"
    assert asyncio.run(service.run(0, 1, [sys.executable, "-c", program], "127.0.0.1", 0.0)) == 0
    assert tries.read_text(encoding="utf-8") == "xxx"


def test_told_to_end_it_ends_its_command_and_says_nothing(tmp_path):
    begun = tmp_path / "begun"
    program = f"import pathlib, time; pathlib.Path({str(begun)!r}).touch(); time.sleep(600)"
    line = [sys.executable, str(BLUEOS / "service.py"), "--port", "0", sys.executable, "-c", program]
    with subprocess.Popen(line, stderr=subprocess.PIPE, text=True) as front:
        until(begun.exists, 20.0)
        front.terminate()
        _, said = front.communicate(timeout=20.0)
    assert front.returncode == 0
    assert len(said.splitlines()) == 1


def test_the_front_lists_the_socket_that_it_opens(service, capsys):
    command = [sys.executable, "-c", ""]
    assert asyncio.run(service.run(0, 1, command, service.EVERYWHERE)) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert re.fullmatch(
        r"open: 0\.0\.0\.0 port [1-9]\d* \(TCP\): the page, for BlueOS and browsers, reachable from every network of "
        r"this container",
        line,
    )
