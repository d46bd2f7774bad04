"""Codes of the texts for the crew, independent of their words."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.wire.status_codes import CrewText, Topic, coded, decoded


@given(st.sampled_from(Topic), st.text(max_size=80), st.none() | st.integers(0, 2**32 - 1))
def test_a_coded_text_is_decoded(topic, words, number):
    assert decoded(coded(topic, words, number)) == CrewText(words, topic, number)


@pytest.mark.parametrize(
    "text",
    ["", "F5", "F9 x", "F5: x", "F5:x y", "F5:-1 x", "F5:1:2 x", "F5:12345678901 x", "FF set 1 active"],
)
def test_any_other_text_is_words_alone(text):
    assert decoded(text) == CrewText(text)


def test_codes_keep_their_meaning():
    assert {topic.name: topic.value for topic in Topic} == {
        "NO_SET": "F1", "UNPROVEN": "F2", "SHADOW": "F3", "STRANGER": "F4", "SET_ACTIVE": "F5",
        "SET_FAULT": "F6", "OBSTACLE": "F7", "ONCE_ARMED": "F8",
    }  # fmt: skip
