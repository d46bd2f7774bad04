"""What a YAML file may hold, beyond what each dataclass checks itself."""

import pytest

from bridge.errors import ConfigError
from bridge.schema import load_yaml


def test_a_key_written_twice_is_named_with_its_line(tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text("name: one\ndry_mass_kg: 7.0\ndry_mass_kg: 72.0\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"line 3.*'dry_mass_kg' stands there twice"):
        load_yaml(path)


def test_anchors_and_nested_keys_of_one_name_are_no_slip(tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text("a: &a {mass: 1}\nb: {mass: 2}\nc: *a\n", encoding="utf-8")
    assert load_yaml(path) == {"a": {"mass": 1}, "b": {"mass": 2}, "c": {"mass": 1}}
