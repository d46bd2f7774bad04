"""Files of ours: whole under their name, and YAML that holds no more than it may."""

import os
from collections.abc import Callable
from contextlib import AbstractContextManager, contextmanager
from errno import ENOSPC
from pathlib import Path
from typing import BinaryIO

import pytest

from bridge.errors import ConfigError, LogError
from bridge.files import replacing, whole, write_whole
from bridge.schema import load_yaml

Writer = Callable[[Path], AbstractContextManager[BinaryIO]]


@contextmanager
def large(path):
    with replacing(path, "try again") as file:
        yield file


@pytest.fixture(params=[whole, large])
def writer(request):
    written: Writer = request.param
    return written


def cut(writer, path):
    with writer(path) as file:
        file.write(b"ne")
        raise OSError(ENOSPC, "No space left on device")


@pytest.fixture
def old(tmp_path):
    path = tmp_path / "dive.yaml"
    path.write_bytes(b"old")
    return path


def test_what_was_there_stays_until_the_new_is_whole(writer, old):
    with writer(old) as file:
        file.write(b"new")
        file.flush()
        assert old.read_bytes() == b"old"
    assert old.read_bytes() == b"new"
    assert list(old.parent.iterdir()) == [old]


def test_a_disk_that_takes_no_more_leaves_the_old_and_nothing_else(writer, old):
    with pytest.raises((OSError, LogError), match="No space left"):
        cut(writer, old)
    assert old.read_bytes() == b"old"
    assert list(old.parent.iterdir()) == [old]


def test_a_link_under_the_name_is_replaced_and_what_it_leads_to_stays(writer, old):
    link = old.with_name("link.yaml")
    link.symlink_to(old)
    with writer(link) as file:
        file.write(b"new")
    assert old.read_bytes() == b"old"
    assert not link.is_symlink()
    assert link.read_bytes() == b"new"


def test_a_name_that_is_no_utf_8_is_written_with_a_mark_in_its_place(old):
    write_whole(old, "vehicle: " + os.fsdecode(b"d\xe9v.yaml") + "\n")
    assert old.read_text(encoding="utf-8") == "vehicle: d?v.yaml\n"
    assert list(old.parent.iterdir()) == [old]


def test_a_key_written_twice_is_named_with_its_line(tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text("name: one\ndry_mass_kg: 7.0\ndry_mass_kg: 72.0\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"line 3.*'dry_mass_kg' stands there twice"):
        load_yaml(path)


def test_anchors_and_nested_keys_of_one_name_are_no_slip(tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text("a: &a {mass: 1}\nb: {mass: 2}\nc: *a\n", encoding="utf-8")
    assert load_yaml(path) == {"a": {"mass": 1}, "b": {"mass": 2}, "c": {"mass": 1}}
