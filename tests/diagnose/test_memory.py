"""Innovations that remember those before are freed of it, and those that do not stay as they are."""

import numpy as np
import pytest

from identify.diagnose.innovations import LEAST_ROWS, autoregression_of


def remembering(share, count, rng):
    fresh, out = rng.standard_normal(count), np.zeros(count)
    for i in range(count):
        out[i] = fresh[i] + (share * out[i - 1] if i else 0.0)
    return fresh, out


def test_what_is_left_of_a_channel_that_remembers_is_what_was_new_each_time():
    fresh, values = remembering(0.6, 20_000, np.random.default_rng(100_001))
    memory = autoregression_of(np.arange(20_000), values)
    left = values[:, None].copy()
    memory.prewhitened(left)
    assert memory.by_lag[0] == pytest.approx(0.6, abs=0.03)
    np.testing.assert_allclose(left[20:, 0], fresh[20:], atol=0.2)


def test_a_column_is_freed_by_the_same_rule_as_the_innovations():
    _, values = remembering(0.6, 5_000, np.random.default_rng(100_002))
    memory = autoregression_of(np.arange(5_000), values)
    both = np.column_stack([values, 3.0 * values])
    memory.prewhitened(both)
    np.testing.assert_allclose(both[:, 1], 3.0 * both[:, 0])


def test_a_channel_leaves_the_rows_of_another_alone():
    _, values = remembering(0.6, 5_000, np.random.default_rng(100_003))
    memory = autoregression_of(np.arange(0, 5_000, 2), values)
    left = values[:, None].copy()
    memory.prewhitened(left)
    np.testing.assert_array_equal(left[1::2, 0], values[1::2])
    assert np.abs(left[::2, 0] - values[::2]).max() > 0.5


def test_white_innovations_keep_all_but_chance_and_a_few_rows_all():
    white = np.random.default_rng(100_004).standard_normal(20_000)
    assert np.abs(autoregression_of(np.arange(20_000), white).by_lag).max() < 0.03
    assert autoregression_of(np.arange(LEAST_ROWS - 1), white).by_lag.size == 0


def test_many_columns_are_freed_as_few_are():
    _, values = remembering(0.6, 5_000, np.random.default_rng(100_005))
    memory = autoregression_of(np.arange(0, 5_000, 2), values)
    many = np.random.default_rng(100_006).standard_normal((5_000, 9))
    few = np.column_stack([prewhitened(memory, many[:, [k]]) for k in range(many.shape[1])])
    np.testing.assert_allclose(prewhitened(memory, many), few, atol=1e-12)


def prewhitened(memory, values):
    out = values.copy()
    memory.prewhitened(out)
    return out
