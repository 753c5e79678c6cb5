"""Numbers of the report: one function gives truth, found and interval their digits."""

import numpy as np
import pytest

from vibrissa.study.paper.printed import plain, printed


def test_truth_found_and_interval_have_the_decimals_of_the_interval():
    text = printed(123.14917, 123.150538, 123.132434, 123.168644)
    assert text == ("123.149", "123.151", "123.132", "123.169")
    assert text.with_interval == "123.151 [123.132, 123.169]"
    assert printed(0.11, 0.110197, 0.109876, 0.11052).truth == "0.11000"


@pytest.mark.parametrize("seed", range(5))
def test_what_lies_within_an_interval_lies_within_it_as_printed(seed):
    rng = np.random.default_rng(seed)
    low, truth, high = np.sort(10 ** rng.uniform(-4, 4) * (1 + rng.uniform(0, 0.2, 3)))
    text = printed(truth, (low + high) / 2, low, high)
    assert float(text.low) <= float(text.truth) <= float(text.high)


def test_without_an_interval_the_difference_has_two_digits():
    assert printed(1.0, 0.9999891)[:2] == ("1", "0.999989")
    assert printed(0.770709, 0.770343)[:2] == ("0.77071", "0.77034")
    assert printed(np.nan, 123.4567)[:2] == ("", "123.457")
    assert printed(np.nan, np.nan).with_interval == "no fit"


def test_zero_has_no_sign_and_a_minus_is_one():
    assert [plain(value, "+.2f") for value in (-0.001, 0.001, -0.5, 0.5)] == ["0.00", "0.00", "−0.50", "+0.50"]
