"""Times: even to a hundredth of an interval, and ascending, whoever asks."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.signals.even_times import even_rate
from vibrissa.signals.smoothing import low_pass

TIME = np.arange(3000) / 3000


def test_stamps_that_are_rounded_to_microseconds_are_even():
    assert even_rate(np.round(TIME, 6)) == pytest.approx(3000, rel=1e-6)
    np.testing.assert_allclose(low_pass(np.round(TIME, 6), TIME, 0.01), low_pass(TIME, TIME, 0.01), atol=1e-6)


@pytest.mark.parametrize(
    ("time", "code"),
    [
        (TIME[::-1], "range"),
        (np.zeros(9), "range"),
        (np.delete(TIME, 7), "range"),
        (np.where(np.arange(3000) == 7, np.nan, TIME), "range"),
        (TIME[:1], "too-few"),
    ],
)
def test_other_times_are_refused(time, code):
    with refusal(code, "time"):
        even_rate(time, least=2)
    with refusal(code, "time"):
        low_pass(time, np.ones(time.size), 0.01)
