"""Builds and runs the container image, and asks it as BlueOS and a browser do; needs Docker or Podman."""

import json
import os
import shutil
import subprocess
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 120.0

pytestmark = pytest.mark.soak


def done(*words, timeout_s=60.0):
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=timeout_s, check=False)


@pytest.fixture(scope="module")
def engine():
    for name in filter(shutil.which, ("docker", "podman")):
        if done(name, "info").returncode == 0:
            return name
    return pytest.skip("needs a container engine that runs: docker or podman")


@pytest.fixture(scope="module")
def image(engine):
    tag = f"seatrial-test:{os.getpid()}"
    build = (
        engine,
        "build",
        "-f",
        "blueos/Dockerfile",
        "--build-arg",
        "REPOSITORY=owner/name",
        "-t",
        tag,
        ".",
    )
    made = done(*build, timeout_s=3600.0)
    assert made.returncode == 0, made.stderr[-3000:]
    yield tag
    done(engine, "image", "rm", "-f", tag)


@pytest.fixture
def address(engine, image):
    """Where the running container answers."""
    begun = done(engine, "run", "-d", "--rm", "-p", "127.0.0.1::80", image)
    assert begun.returncode == 0, begun.stderr
    container = begun.stdout.strip()
    yield f"http://{done(engine, 'port', container, '80/tcp').stdout.split()[0]}"
    done(engine, "rm", "-f", container)


def asked(address, path):
    """The body of an answer, asked for until the program in the container is up."""
    until_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            with urllib.request.urlopen(f"{address}{path}", timeout=5.0) as answer:
                return answer.read().decode()
        except (urllib.error.URLError, ConnectionError):
            if time.monotonic() > until_s:
                raise
            time.sleep(0.5)


def test_the_container_registers_with_blueos_and_serves_the_page(address):
    registered = json.loads((ROOT / "blueos/register_service.json").read_text(encoding="utf-8"))
    assert json.loads(asked(address, "/register_service")) == registered
    assert "<title>" in asked(address, "/")


def test_the_image_dives_and_keeps_what_it_makes_in_its_folder(engine, image, tmp_path):
    dive = ("seatrial", "simulate", "--vehicle", "ruvifist:hovering", "--mission", "validation")
    ran = done(
        engine,
        "run",
        "--rm",
        "-v",
        f"{tmp_path}:/data",
        "--entrypoint",
        dive[0],
        image,
        *dive[1:],
        timeout_s=600.0,
    )
    assert ran.returncode == 0, ran.stderr
    assert list(tmp_path.glob("dives/*-validation-off/telemetry.tlog"))
