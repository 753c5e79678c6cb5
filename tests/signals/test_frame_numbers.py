"""Frames of a profile are numbered as in its movie, whatever part of it was selected."""

import numpy as np
import pytest
import xarray as xr

from vibrissa.signals.frame_numbers import frame_numbers


@pytest.mark.parametrize("rate", [30.0, 500.0, 999.7, 1000 / 3])
def test_a_part_keeps_the_numbers_of_the_movie(rate):
    first = 100  # of a part that was tracked
    time = ("time", (first + np.arange(3000)) / rate)
    whole = xr.Dataset(coords={"time": time}, attrs={"frame_rate": rate, "first_frame": first})
    assert frame_numbers(whole).tolist() == list(range(100, 3100))
    assert frame_numbers(whole.isel(time=slice(35, 200))).tolist() == list(range(135, 300))
    assert frame_numbers(whole.isel(time=[7])).tolist() == [107]
    assert frame_numbers(whole.isel(time=slice(None, None, 2))).tolist() == list(range(100, 3100, 2))


def test_without_a_rate_the_times_have_it():
    part = xr.Dataset(coords={"time": ("time", np.arange(235, 240) / 500)})
    assert frame_numbers(part).tolist() == [235, 236, 237, 238, 239]
