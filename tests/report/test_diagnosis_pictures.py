"""The pictures of a diagnosis: a map of shares, and bars whose names stand clear."""

import numpy as np
import pytest

from identify.report.plot import Bar, bars, heatmap, stack


def drawn(panel):
    (box,) = stack([panel])(10.0).axes
    return box


def test_the_map_shades_the_largest_most_and_names_its_rows_and_columns():
    box = drawn(heatmap(("at rest", "steady"), ("surge", "yaw"), np.array([[0.0, 0.1], [0.7, 0.2]])))
    assert np.asarray(box.collections[0].get_array()).ravel().tolist() == [0, 1, 5, 2]
    assert [label.get_text() for label in box.get_yticklabels()] == ["at rest", "steady"]
    assert [label.get_text() for label in box.get_xticklabels()] == ["surge", "yaw"]


def test_bars_are_no_longer_than_their_room_and_never_negative():
    box = drawn(bars((Bar("a", 1.3, "7 N", "accepted"), Bar("b", -0.2, "−1 N"), Bar("<c>", 0.5, "1 N"))))
    assert [bar.get_width() for bar in box.patches] == [1.0, 0.0, 0.5]
    filled, hollow, _ = (bar.get_facecolor() for bar in box.patches)
    assert filled != hollow
    assert [text.get_text() for text in box.texts] == ["a: accepted", "7 N", "b", "−1 N", "<c>", "1 N"]


@pytest.mark.parametrize("width_in", [10.0, 3.46])
@pytest.mark.parametrize(
    "name", ["0.30 to 0.60 m/s", "waves (2.25 and 2.33 s) (too little here: 30 nats are asked for)"]
)
def test_names_of_bars_stand_clear_of_the_bars_and_their_numbers(width_in, name):
    picture = stack(
        [bars([Bar(name, 1.0, "1000 nats")] * 3 + [Bar("a", 1.0, "1", "accepted")] * ("waves" in name))]
    )(width_in)
    picture.draw_without_rendering()
    (box,) = picture.axes
    places = [text.get_window_extent() for text in box.texts]
    assert not [(a, b) for i, a in enumerate(places) for b in places[:i] if a.overlaps(b)]
