"""Numbers in captions have two digits of their error."""

import numpy as np
import pytest

from vibrissa.figures.canvas import p_words, tail_words
from vibrissa.figures.words import with_error, with_interval


@pytest.mark.parametrize(
    ("value", "error", "words"),
    [
        (0.290163, 0.001123, "0.2902 ± 0.0011"),
        (-1.2, 0.0996, "−1.20 ± 0.10"),
        (45.83, 2.95, "45.8 ± 3.0"),
        (1234.5, 47.0, "1234 ± 47"),
        (3.14159, np.nan, "3.14"),
        (np.nan, 0.1, "not determined"),
    ],
)
def test_a_value_has_the_digits_of_its_error(value, error, words):
    assert with_error(value, error) == words


def test_an_interval_has_two_digits_of_its_half_width():
    assert with_interval(3.7512, 3.4132, 4.1224) == "3.75 [3.41, 4.12]"
    assert with_interval(3.7512, 3.0, 4.5) == "3.75 [3.00, 4.50]"
    assert with_interval(3.7512, np.nan, np.nan) == "3.75"
    assert with_interval(np.nan, 0, 1) == "not determined"


def test_small_p_values_have_one_digit_and_very_small_ones_a_power_of_ten():
    assert [p_words(one) for one in (0.3123, 0.0079, 0.00051, 3.2e-12)] == ["0.31", "0.008", "0.0005", "3 × 10⁻¹²"]
    assert p_words(np.nan) == "not determined"
    assert tail_words(1e-9) == "< 10⁻⁶"
