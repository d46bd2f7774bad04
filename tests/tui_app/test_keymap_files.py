"""Keymap files: the shipped example is true, and mistakes are named with what to do."""

import pytest
import yaml

from bridge.errors import ConfigError
from bridge.vehicle.config import CONFIGS
from tui.app.keys import load_keymap, user_file
from tui.app.screens.table import PLACES


@pytest.fixture
def keymap_of(tmp_path):
    def load(text):
        file = tmp_path / "keymap.yaml"
        file.write_text(text, encoding="utf-8")
        return load_keymap(file, PLACES)

    return load


def test_the_shipped_example_lists_every_action_with_its_default():
    example = yaml.safe_load((CONFIGS / "keymap.yaml").read_text(encoding="utf-8"))
    assert example == {action.id: action.keys for place in PLACES for action in place}
    assert load_keymap(CONFIGS / "keymap.yaml", PLACES) == example


def test_keys_are_given_by_action(keymap_of):
    assert keymap_of('ff.off: "f9, ctrl+o"\nscreen.watch: 9\n') == {
        "ff.off": "f9,ctrl+o",
        "screen.watch": "9",
    }


def test_an_empty_file_changes_nothing(keymap_of):
    assert keymap_of("# nothing yet\n") == {}


def test_an_unknown_action_names_the_nearest(keymap_of):
    with pytest.raises(ConfigError, match=r"keymap\.yaml: unknown action 'ff\.of'; did you mean 'ff\.off'\?"):
        keymap_of('ff.of: "f9"')


def test_an_action_like_none_lists_all(keymap_of):
    with pytest.raises(ConfigError, match=r"unknown action 'zzz'; the actions are ff\.off, .*help\.close"):
        keymap_of('zzz: "f9"')


@pytest.mark.parametrize(
    ("text", "both"),
    [
        ('watch.words: "c"', "the key 'c' belongs to both watch.charts and watch.words"),
        ('theme.next: "c"', "the key 'c' belongs to both theme.next and watch.charts"),
        ('theme.next: "?"', "the key 'question_mark' belongs to both app.help and theme.next"),
        ('ff.off: "escape"', "the key 'escape' belongs to both ff.off and app.close"),
    ],
)
def test_two_actions_on_one_key_are_refused(keymap_of, text, both):
    with pytest.raises(ConfigError, match=both):
        keymap_of(text)


def test_two_actions_may_change_places(keymap_of):
    swapped = {"watch.words": "c", "watch.charts": "w"}
    assert keymap_of('watch.words: "c"\nwatch.charts: "w"') == swapped


@pytest.mark.parametrize("keys", ["no", '""', "[c]", "{c: d}", "1.5"])
def test_what_is_not_text_is_asked_for_in_quotes(keymap_of, keys):
    with pytest.raises(ConfigError, match=r"theme\.next: give its keys in quotes"):
        keymap_of(f"theme.next: {keys}")


@pytest.mark.parametrize("key", ["ctrl+", "controll+c", "f99", "nokey", "c,,d"])
def test_what_is_no_key_is_named(keymap_of, key):
    with pytest.raises(ConfigError, match=r"theme\.next: '.*' is no key"):
        keymap_of(f'theme.next: "{key}"')


@pytest.mark.parametrize(
    "key", ["f20", "ctrl+o", "shift+tab", "alt+x", "pagedown", "full_stop", "ä", "ctrl+underscore"]
)
def test_what_terminals_send_is_a_key(keymap_of, key):
    assert keymap_of(f'theme.next: "{key}"') == {"theme.next": key}


def test_a_file_that_is_no_keymap_is_refused(keymap_of):
    with pytest.raises(ConfigError, match="it is none"):
        keymap_of("- c\n- d\n")


def test_the_users_own_file_is_taken_where_none_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert load_keymap(None, PLACES) == {}
    user_file().parent.mkdir()
    user_file().write_text('theme.next: "f5"', encoding="utf-8")
    assert load_keymap(None, PLACES) == {"theme.next": "f5"}


@pytest.mark.parametrize(("sign", "name"), [("-", "minus"), ("_", "underscore"), ("/", "slash")])
def test_a_sign_and_its_name_are_one_key(keymap_of, sign, name):
    with pytest.raises(ConfigError, match=f"the key '{name}' belongs to both"):
        keymap_of(f'theme.next: "{sign}"\napp.help: "{name}"')
