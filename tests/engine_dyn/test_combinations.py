"""Different combinations of numbers: the same as sorted rows of a table."""

import numpy as np
import pytest

from engine_dyn.combinations import distinct_combinations


def test_they_are_the_sorted_rows_of_a_table() -> None:
    random = np.random.default_rng(3)
    columns = random.integers(-2, 3, (4, 500)) * 0.7
    rows, number = np.unique(columns.T, axis=0, return_inverse=True)
    table, which = distinct_combinations(*columns)
    np.testing.assert_array_equal(table, rows)
    np.testing.assert_array_equal(which, number.reshape(-1))
    np.testing.assert_array_equal(table[which], columns.T)


@pytest.mark.parametrize("shapes", [((), ()), ((3, 1), (1, 4)), ((1,), (5,), ()), ((2, 3), (3,))])
def test_values_broadcast(shapes: tuple[tuple[int, ...], ...]) -> None:
    values = [np.arange(np.prod(shape, dtype=int)).reshape(shape) % 2 for shape in shapes]
    table, which = distinct_combinations(*values)
    assert which.shape == np.broadcast_shapes(*shapes)
    for column, value in zip(table.T, values, strict=True):
        np.testing.assert_array_equal(column[which], np.broadcast_to(value, which.shape))


def test_many_columns_of_many_values_keep_their_numbers() -> None:
    columns = np.random.default_rng(5).uniform(size=(8, 3000))
    table, which = distinct_combinations(*columns)
    np.testing.assert_array_equal(table[which], columns.T)
