"""Times: even to a hundredth of an interval or to their last digit, and ascending, whoever asks."""

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

from vibrissa.api.objects.signals import as_signal
from vibrissa.quantities import require
from vibrissa.rounded_times import repeated_by_rounding
from vibrissa.signals.even_times import even_rate, misfit_of
from vibrissa.signals.smoothing import low_pass

TIME = np.arange(3000) / 3000


def test_stamps_that_are_rounded_to_microseconds_are_even():
    assert even_rate(np.round(TIME, 6)) == pytest.approx(3000, rel=1e-6)
    np.testing.assert_allclose(low_pass(np.round(TIME, 6), TIME, 0.01), low_pass(TIME, TIME, 0.01), atol=1e-6)


CLOCKS = [(30000, 6), (2048, 4), (44100, 6), (300, 3), (1000, 3)]  # [Hz], decimals of a second


@pytest.mark.parametrize(("rate", "decimals"), CLOCKS)
@pytest.mark.parametrize("cut", [np.round, lambda time, n: np.floor(np.round(time * 10**n, 6)) / 10**n])
def test_stamps_rounded_or_cut_to_a_decimal_are_even_unless_one_is_lost(rate, decimals, cut):
    stamps = cut(np.arange(3000) / rate, decimals)
    assert even_rate(stamps) == pytest.approx(rate, rel=10**-decimals * rate / 2999)
    for lost in (1, 2, 1499, 1500, 2998):
        misfit = misfit_of(np.delete(stamps, lost))
        assert (misfit.sample, misfit.remedy) == (lost, "interpolate where samples were lost")


@pytest.mark.parametrize(("rate", "decimals"), [(2000, 3), (1200, 3), (30000, 4), (2000, 2), (20000, 3)])
@pytest.mark.parametrize("zero", [0, 12.5])
def test_times_that_repeat_as_they_are_rounded_are_not_to_be_sorted(rate, decimals, zero):
    stamps = np.round(zero + np.arange(3000) / rate, decimals)
    misfit = misfit_of(stamps)
    assert misfit.remedy == "write times with more decimals"
    assert f"rounded to {10**-decimals:g} s" in misfit.found
    assert stamps[misfit.sample] == stamps[misfit.sample - 1]
    stamps[[1000, 1100]] = stamps[[1100, 1000]]  # rounded or not, these are to be sorted
    assert misfit_of(stamps).remedy.startswith("sort")


@pytest.mark.parametrize(("rate", "decimals"), [(1000, 3), (2048, 4), (300, 3)])
def test_a_sample_stored_twice_is_not_taken_for_rounding(rate, decimals):
    stamps = np.round(np.arange(3000) / rate, decimals)
    for twice in ([1500], [3], [10, 20, 2000]):
        assert misfit_of(np.insert(stamps, twice, stamps[twice])).remedy.startswith("sort")


@pytest.mark.parametrize("time", [[0, 1, 3], [0, 1, 3, 4], [0, 1, 2, 4], [0, 1, 2, 4, 5, 6], [0, 1, 1, 3, 4]])
def test_whole_numbers_with_one_missing_are_not_taken_for_rounded(time):
    assert misfit_of(np.array(time, float))


def test_the_diagnosis_is_that_of_the_fault():
    drift = np.concatenate([TIME, TIME[-1] + np.arange(1, 1000) / 2950])
    swapped = np.arange(10) / 3000
    swapped[[4, 5]] = swapped[[5, 4]]
    late = TIME + np.where(np.arange(3000) == 7, 0.2 / 3000, 0)
    for time, sample, remedy in ((drift, 2999, "resample"), (swapped, 5, "sort"), (late, 7, "resample")):
        misfit = misfit_of(time)
        assert misfit.sample == sample
        assert misfit.remedy.startswith(remedy)


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


@pytest.mark.parametrize("zero", [0, 1, 10, 1000, 86400, -1000])
@pytest.mark.parametrize("rate", [2000.0, 20000.0, 24414.0625, 0.5])
def test_the_rate_does_not_depend_on_the_zero_of_the_clock(zero, rate):
    assert even_rate(np.arange(24000) / rate + zero) == rate


@pytest.mark.parametrize("rate", [1000 / 3, 500 / 0.7, 44100 / 7])
def test_nor_does_a_rate_of_many_decimals(rate):
    found = [even_rate(np.arange(24000) / rate + zero) for zero in (0, 1, 10, 1000)]
    assert len(set(found)) == 1
    assert found[0] == pytest.approx(rate, rel=1e-11)


def rounded(rate, lost=(), unit=3):
    return np.round(np.delete(np.arange(4000) / rate, lost), unit)


LOST = {"none": [], "ten": range(1000, 1010), "here and there": np.arange(150, 4000, 400), "half": range(1000, 3000)}


@pytest.mark.parametrize("lost", LOST)
@pytest.mark.parametrize("rate", [1020.0, 1050.0, 1200.0, 2000.0, 2500.0])
def test_rounded_times_are_rounded_to_every_reader_also_where_samples_were_lost(rate, lost):
    stamps = rounded(rate, LOST[lost])
    with refusal("range", "time") as caught:
        even_rate(stamps)
    assert caught.value.remedy.startswith("write times with more decimals")
    assert f"rounded to 0.001 s, at intervals of {1 / rate:.2g} s" in str(caught.value)
    signal = xr.DataArray(np.sin(stamps), {"time": stamps}, ["time"], attrs={"units": "m"})
    for reads in (lambda: as_signal(signal), lambda: require(signal.to_dataset(name="point_displacement"), "time")):
        with refusal("range") as again:
            reads()
        assert again.value.remedy == caught.value.remedy


@pytest.mark.parametrize("lost", LOST)
@pytest.mark.parametrize("rate", [300.0, 1000.0])
def test_samples_stored_twice_here_and_there_are_not_taken_for_rounding_where_others_were_lost(rate, lost):
    rng, stamps = np.random.default_rng(3), rounded(rate, LOST[lost])
    twice = np.sort(rng.choice(stamps.size, 200, replace=False))
    assert repeated_by_rounding(np.insert(stamps, twice, stamps[twice])) is None
    assert misfit_of(np.insert(stamps, twice, stamps[twice])).remedy.startswith("sort")


@pytest.mark.parametrize("spacing", [100, 1])
def test_samples_stored_twice_at_even_spacings_have_both_remedies(spacing):
    """They look like times of 1010 or 2000 Hz rounded to a millisecond; at 300 Hz no rounding repeats times."""
    twice = np.arange(0, 4000, spacing)
    for rate, remedy in ((1000, "write times with more decimals, or, if its value is doubled"), (300, "sort")):
        stamps = rounded(rate)
        assert misfit_of(np.insert(stamps, twice, stamps[twice])).remedy.startswith(remedy)


@pytest.mark.parametrize("time", [[0, 0, 0], [0, 0], [0], [], [0, np.nan, 0, 1], [np.inf, np.inf, 1], [2, 1, 1, 0]])
def test_times_of_another_fault_are_not_taken_for_rounded(time):
    assert repeated_by_rounding(np.array(time, float)) is None
