"""What of docs/ is made from the code is what the code makes now."""

import argparse
import re

import pytest

from docs.make.__main__ import REFERENCE, pages
from docs.make.markdown import table
from tui import cli

MADE = pages()


def options(parser):
    """Every option of a parser, those of its sub-parsers included."""
    for action in parser._actions:
        yield from (option for option in action.option_strings if option not in ("-h", "--help"))
        if isinstance(action, argparse._SubParsersAction):
            for sub in action.choices.values():
                yield from options(sub)


@pytest.mark.parametrize("name", MADE)
def test_a_page_of_the_reference_is_what_the_code_makes(name):
    kept = (REFERENCE / name).read_text(encoding="utf-8")
    assert kept == MADE[name], f"docs/reference/{name} is not what the code makes: run `make docs`"


def test_the_reference_has_no_page_that_nobody_makes():
    assert {path.name for path in REFERENCE.iterdir()} == set(MADE)


@pytest.mark.parametrize("verb", cli.VERBS)
def test_every_option_of_a_verb_is_in_the_reference_with_words(verb):
    (text,) = re.findall(rf"^## {verb}\n(.*?)(?=^## )", MADE["commands.md"], re.M | re.S)
    told = dict(re.findall(r"^\| `([^`]+)` \| (.*) \|$", text, re.M))
    assert all(told.values())
    for option in options(cli.verb_parser(verb)):
        assert any(re.search(rf"(^| ){option}\b", argument) for argument in told), option


def test_a_bar_in_a_cell_does_not_end_it():
    assert table(("a",), [("N|max",)]) == "| a |\n| --- |\n| N\\|max |\n"


def test_every_picture_stays_small_and_asks_for_no_net():
    pictures = list((REFERENCE.parent / "images").iterdir())
    assert pictures
    for picture in pictures:
        assert picture.stat().st_size < 300_000, f"{picture.name} is too large"
        text = picture.read_text(encoding="utf-8").replace("http://www.w3.org/", "")
        assert "http" not in text, f"{picture.name} names an address"
