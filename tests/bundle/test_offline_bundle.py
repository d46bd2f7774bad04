"""The archive that installs without a net: made by a pip that downloads nothing, and unpacked again."""

import hashlib
import os
import resource
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from bundle import __main__ as command
from bundle.build import BundleError, build
from bundle.complete import lacking
from bundle.targets import Target
from tui import cli

ROOT = Path(__file__).resolve().parents[2]
PC, PI, MAC = Target("x86_64", "3.11"), Target("aarch64", "3.13"), Target("arm64", "3.12")
PROJECT = """
[project]
version = "1.2"
dependencies = ["numpy"]

[project.optional-dependencies]
ground = ["torch==2.0", "scipy"]
bags = ["rosbags", "old; python_version < '3.12'"]
logs = ["seatrial[bags]", "tables; platform_machine == 'x86_64'"]
"""


def wheel(folder, name, version="1.0", tag="py3-none-any", requires=()):
    """A wheel with metadata and nothing else."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ["Metadata-Version: 2.1", f"Name: {name}", f"Version: {version}"]
    lines += [f"Requires-Dist: {text}" for text in requires]
    with zipfile.ZipFile(folder / f"{name}-{version}-{tag}.whl", "w") as archive:
        archive.writestr(f"{name}-{version}.dist-info/METADATA", "\n".join(lines))
        archive.writestr(f"{name}/_vendor/other-1.0.dist-info/METADATA", "Requires-Dist: nothing-of-it")


class FakePip:
    """Has a wheel for all that is asked for, but for `absent`; what they require is in `requires`. `asked` is kept."""

    def __init__(self, absent=(), requires=None):
        self.absent, self.requires, self.asked = absent, requires or {}, []

    def __call__(self, words):
        if words[0] == "wheel":
            wheel(Path(words[words.index("--wheel-dir") + 1]), "seatrial", "1.2")
            return "no hatchling" if "seatrial" in self.absent else ""
        folder = Path(words[words.index("--dest") + 1])
        last = max(n for n, word in enumerate(words) if word.startswith("--"))
        asked = [Requirement(word) for word in words[last + 2 :]]
        self.asked.append([str(item) for item in asked])
        for item in asked:
            if item.name in self.absent or str(item) in self.absent:
                return f"No matching distribution found for {item}"
            version = next((spec.version for spec in item.specifier), "1.0")
            tag = "py3-none-any" if item.name == "scipy" else f"py3-none-{words[last + 1]}"
            wheel(folder, item.name, version, tag, self.requires.get(item.name, ()))
        return ""


@pytest.fixture
def made(tmp_path):
    """Make a bundle, and unpack it: the archive, and the folder."""
    (tmp_path / "pyproject.toml").write_text(PROJECT, encoding="utf-8")

    def make(pip, *targets):
        bundle = build(tmp_path, tmp_path / "dist", targets, pip, lambda _: None)
        with tarfile.open(bundle.file) as archive:
            archive.extractall(tmp_path / "unpacked", filter="data")
        (folder,) = (tmp_path / "unpacked").iterdir()
        return bundle, folder

    return make


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--machines", "riscv"], "unknown machine riscv"),
        (["--pythons", "3.11.4 3"], "unknown Python 3.11.4, 3; name it as 3.11"),
        (["--machines", ""], "name a machine"),
    ],
)
def test_what_names_no_computer_is_refused_before_anything_is_fetched(
    words, said, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(command, "build", lambda *_: pytest.fail("made all the same"))
    with pytest.raises(SystemExit):
        command.main([*words, "--out", str(tmp_path)])
    assert said in capsys.readouterr().err


def names(folder):
    return {path.name.split("-")[0] for path in folder.glob("*.whl")}


def test_the_vehicle_and_the_ground_have_a_folder_of_wheels_each(made):
    bundle, folder = made(FakePip(), PC, PI)
    assert bundle.file.name == "seatrial-1.2-offline.tar"
    assert names(folder / "wheels" / "bridge") == {"seatrial", "numpy"}
    assert names(folder / "wheels" / "ground") == {"torch", "scipy", "rosbags", "old", "tables"}
    assert (folder / "holds.txt").read_text(encoding="ascii").splitlines() == [
        "bridge x86_64 3.11",
        "ground x86_64 3.11",
        "logs x86_64 3.11",
        "bridge aarch64 3.13",
        "ground aarch64 3.13",
        "logs aarch64 3.13",
    ]


def test_an_archive_that_no_disk_takes_leaves_the_one_before(made, tmp_path):
    bundle, _ = made(FakePip(), PC)
    before = bundle.file.read_bytes()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, hard))
    try:
        with pytest.raises(
            BundleError, match=r"offline\.tar: can't be written \(File too large\); free disk space"
        ):
            build(tmp_path, tmp_path / "dist", (PI,), FakePip(), lambda _: None)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert bundle.file.read_bytes() == before


def test_every_file_has_its_sum(made):
    _, folder = made(FakePip(), PC)
    lines = (folder / "SHA256SUMS").read_text(encoding="utf-8").splitlines()
    sums = dict(reversed(line.split("  ")) for line in lines)
    files = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert set(sums) == files - {"SHA256SUMS"}
    assert all(hashlib.sha256((folder / name).read_bytes()).hexdigest() == sums[name] for name in sums)


def test_linux_gets_pytorchs_cpu_build_and_macos_the_only_one_that_there_is(made):
    pip = FakePip()
    made(pip, PC, MAC)
    assert [line for line in pip.asked if "scipy" in line] == [
        ["numpy", "torch==2.0+cpu", "scipy", "rosbags", "old", "tables"],
        ["numpy", "torch==2.0", "scipy", "rosbags"],
    ]


def test_readers_without_a_wheel_are_left_out_and_the_ground_station_stays(made):
    bundle, folder = made(FakePip(absent=["rosbags"]), PI)
    assert [part for part, _ in bundle.holds] == ["bridge", "ground"]
    (sentence,) = bundle.left_out
    assert sentence.startswith("logs: Linux aarch64, Python 3.13: No matching distribution found for rosbags")
    assert names(folder / "wheels" / "ground") == {"torch", "scipy"}


def test_where_the_cpu_build_is_missing_the_ground_station_is_left_out_and_said(made):
    bundle, folder = made(FakePip(absent=["torch==2.0+cpu"]), PI, MAC)
    assert [(part, target.machine) for part, target in bundle.holds] == [
        ("bridge", "aarch64"),
        ("bridge", "arm64"),
        ("ground", "arm64"),
        ("logs", "arm64"),
    ]
    _, sentence = bundle.left_out
    assert sentence.startswith("ground: Linux aarch64, Python 3.13: No matching distribution found for torch")
    assert sentence in (folder / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("absent", "words"), [("numpy", "the bridge for Linux x86_64"), ("seatrial", "own wheel")]
)
def test_without_the_bridge_there_is_no_archive(made, absent, words):
    with pytest.raises(BundleError, match=words):
        made(FakePip(absent=[absent]), PC)


def test_what_only_another_python_needs_is_fetched_too(made):
    pip = FakePip(
        requires={"torch": ['setuptools; python_version >= "3.12"', 'cuda; platform_machine == "x86_64"']}
    )
    _, folder = made(pip, PI)
    assert names(folder / "wheels" / "ground") == {"torch", "scipy", "rosbags", "setuptools"}


def test_a_wheel_of_another_machine_or_version_meets_nothing(tmp_path):
    wheel(tmp_path, "one", "1.0", "cp311-cp311-manylinux_2_28_x86_64", ["two>=2; extra == 'more'"])
    wheel(tmp_path, "two", "1.5")
    assert lacking([tmp_path], ["one"], PC) == []
    assert lacking([tmp_path], ["one[more]"], PC) == ["two>=2"]
    assert lacking([tmp_path], ["one"], PI) == ["one"]
    assert lacking([tmp_path], ["one<1"], PC) == ["one<1"]
    assert lacking([tmp_path], ["one; sys_platform == 'win32'"], PI) == []


def installed(folder, *words, **environment):
    return subprocess.run(
        ["sh", str(folder / "install.sh"), *words],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )


def fake_python(path, version):
    """A Python of another version that makes an environment whose Python writes down what pip is told."""
    path.write_text(
        "#!/bin/sh\n"
        f'if [ "$1" = -c ]; then echo {version}; exit; fi\n'
        'mkdir -p "$3/bin"; printf \'#!/bin/sh\\necho "$@" > "%s/told"\\n\' "$3" > "$3/bin/python"\n'
        'chmod +x "$3/bin/python"\n',
        encoding="ascii",
    )
    path.chmod(0o755)
    return str(path)


@pytest.fixture
def here(made, tmp_path):
    """A bundle for this very machine, and a Python for it."""
    machine = os.uname().machine
    _, folder = made(FakePip(), Target(machine, "3.11"))
    return folder, fake_python(tmp_path / "python", "3.11")


def test_the_script_installs_from_the_folder_alone(here, tmp_path):
    folder, python = here
    for words, package in (([], "seatrial[ground,logs]"), (["--bridge"], "seatrial")):
        done = installed(folder, *words, str(tmp_path / "environment"), PYTHON=python)
        assert done.returncode == 0, done.stderr
        arguments = (tmp_path / "environment" / "told").read_text(encoding="utf-8").split()
        assert arguments[-1] == package
        assert "--no-index" in arguments
        assert (str(folder / "wheels" / "ground") in arguments) == (package != "seatrial")


def test_its_words_come_in_any_order_and_one_that_it_does_not_know_installs_nothing(
    here, tmp_path, monkeypatch
):
    folder, python = here
    done = installed(folder, str(tmp_path / "there"), "--bridge", PYTHON=python)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "there" / "told").read_text(encoding="utf-8").split()[-1] == "seatrial"
    done = installed(folder, "--brigde", PYTHON=python, HOME=str(tmp_path / "home"))
    assert (done.returncode, done.stdout) == (2, "")
    assert "there is no --brigde" in done.stderr
    assert not (tmp_path / "home").exists()
    monkeypatch.delenv("HOME")
    assert installed(folder, str(tmp_path / "there"), PYTHON=python).returncode == 0


def test_a_damaged_wheel_is_not_installed(here, tmp_path):
    folder, python = here
    next((folder / "wheels" / "bridge").iterdir()).write_bytes(b"damaged")
    done = installed(folder, str(tmp_path / "there"), PYTHON=python)
    assert done.returncode == 1
    assert "a file is not as it was packed" in done.stderr


def test_where_there_is_no_sha256sum_as_on_macos_the_sums_are_checked_by_shasum(here, tmp_path):
    folder, python = here
    tools = tmp_path / "tools"
    tools.mkdir()
    for name in ("sh", "dirname", "uname", "grep", "mkdir", "chmod"):
        (tools / name).symlink_to(shutil.which(name))
    shasum = f'#!/bin/sh\n[ "$1 $2" = "-a 256" ] && shift 2\nexec {shutil.which("sha256sum")} "$@"\n'
    (tools / "shasum").write_text(shasum, encoding="ascii")
    (tools / "shasum").chmod(0o755)
    done = installed(folder, str(tmp_path / "there"), PYTHON=python, PATH=str(tools))
    assert (done.returncode, done.stderr) == (0, "")
    next((folder / "wheels" / "bridge").iterdir()).write_bytes(b"damaged")
    done = installed(folder, str(tmp_path / "there"), PYTHON=python, PATH=str(tools))
    assert "a file is not as it was packed" in done.stderr


def test_a_python_that_the_bundle_does_not_serve_is_told_which_it_does(here, tmp_path):
    folder, _ = here
    other = fake_python(tmp_path / "other", "3.14")
    done = installed(folder, str(tmp_path / "there"), PYTHON=other)
    assert done.returncode == 1
    assert f"no 'ground' for {os.uname().machine} and Python 3.14; it has:" in done.stderr
    assert installed(folder, PYTHON=str(tmp_path / "none")).returncode == 1


def test_what_the_bridge_imports_is_what_it_requires():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    required = {Requirement(text).name for text in project["dependencies"]}
    modules = {"serial": "pyserial", "yaml": "pyyaml"}
    code = (
        "import sys; had = set(sys.modules); "
        "import bridge.__main__, bridge.onboard.ports, bridge.onboard.service, bridge.onboard.ring, "
        "bridge.onboard.file_server, bridge.links.open, bridge.signing.link; "
        "print(*{m.partition('.')[0] for m in set(sys.modules) - had})"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    result = {modules.get(name, name) for name in done.stdout.split()} - sys.stdlib_module_names
    ground = {Requirement(text).name for text in project["optional-dependencies"]["ground"]}
    assert result & {"numpy", "pymavlink"} == {"numpy", "pymavlink"}
    assert result.isdisjoint(ground)
    assert not required & ground


def test_without_the_ground_station_its_verbs_say_what_to_install(monkeypatch, capsys):
    def run(*_):
        raise ModuleNotFoundError("No module named 'torch'", name="torch")

    monkeypatch.setattr("tui.cli._run", run)
    assert cli.main(["identify"]) == 2
    assert "torch is not installed: this is the bridge alone; install the ground" in capsys.readouterr().err


@pytest.mark.soak
def test_the_wheel_dives_a_shipped_vehicle_where_there_is_no_checkout(tmp_path):
    made = subprocess.run(
        ["make", "-C", ROOT, "wheel", f"BIN={Path(sys.executable).parent}"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    (wheel,) = (ROOT / line for line in made.stdout.splitlines() if line.endswith(".whl"))
    pip = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--target",
        tmp_path / "site",
        wheel,
    ]
    subprocess.run(pip, check=True)
    dive = ["simulate", "--vehicle", "ruvifist:hovering", "--mission", "validation", "--out", "dives"]
    subprocess.run(
        [sys.executable, "-P", "-m", "tui", *dive],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path / "site")}, check=True,
    )  # fmt: skip
    assert list(tmp_path.glob("dives/*-validation-off/telemetry.tlog"))
    assert (tmp_path / "site/bin/seatrial").exists()
