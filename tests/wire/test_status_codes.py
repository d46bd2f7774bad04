"""Codes of the texts for the crew, independent of their words."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.wire.status_codes import CrewText, Topic, coded, decoded, status_texts


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


@pytest.mark.parametrize(
    ("length", "pieces"), [(0, 1), (1, 1), (50, 1), (51, 2), (99, 2), (100, 3), (150, 4)]
)
def test_a_long_text_ends_with_a_piece_that_is_not_full(length, pieces):
    """MAVLink: a NUL in a piece says that it is the last; a full one has none, and its receiver would wait on."""
    text = "ab" * 75
    messages = status_texts(text[:length], 4, 7)
    assert "".join(message.text for message in messages) == text[:length]
    assert [message.chunk_seq for message in messages] == list(range(pieces))
    assert {message.id for message in messages} == {0 if pieces == 1 else 7}
    assert pieces == 1 or len(messages[-1].text) < 50
