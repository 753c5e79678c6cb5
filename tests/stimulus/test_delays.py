"""Copies of a loop: their correlations, and delays that make them small."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.stimulus.band import Band
from vibrissa.stimulus.delays import (
    circular_correlation,
    correlation_note,
    even_shifts,
    least_shifts,
    pair_correlations,
    random_shifts,
)


def noise(seed, n=20000, rate=2000.0):
    return Band().filtered(np.random.default_rng(seed).normal(size=n), rate)


def largest(pairs):
    return np.abs(pairs - np.diag(np.diag(pairs))).max()


@given(seed=st.integers(0, 999))
@settings(max_examples=10, deadline=None)
def test_pair_correlations_are_those_of_the_copies_themselves(seed):
    rng = np.random.default_rng(seed)
    loop, shifts = rng.normal(1, 1, 501), rng.integers(0, 501, 7)
    copies = np.array([np.roll(loop, shift) for shift in shifts])
    np.testing.assert_allclose(pair_correlations(circular_correlation(loop), shifts), np.corrcoef(copies), atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_24_copies_of_a_broad_band_loop_are_uncorrelated(seed):
    r = circular_correlation(noise(seed))
    assert largest(pair_correlations(r, even_shifts(24, 20000))) < 0.1
    assert largest(pair_correlations(r, least_shifts(r, 24, 200))) < 0.1


def test_searched_delays_beat_even_ones_and_keep_their_separation():
    r = circular_correlation(noise(4))
    found = least_shifts(r, 24, 200)
    assert largest(pair_correlations(r, found)) < largest(pair_correlations(r, even_shifts(24, 20000)))
    gaps = np.diff(np.sort(found), append=np.sort(found)[0] + 20000)
    assert gaps.min() >= 200
    np.testing.assert_array_equal(found, least_shifts(r, 24, 200))


@given(seed=st.integers(0, 999), separation=st.integers(0, 40))
@settings(max_examples=30, deadline=None)
def test_random_delays_keep_their_separation_around_the_loop(seed, separation):
    shifts = random_shifts(24, 1000, separation, rng=np.random.default_rng(seed))
    ordered = np.sort(shifts)
    assert shifts[0] == 0
    assert np.diff(ordered, append=ordered[0] + 1000).min() >= separation
    np.testing.assert_array_equal(shifts, random_shifts(24, 1000, separation, rng=np.random.default_rng(seed)))


def test_a_regular_texture_cannot_be_uncorrelated_and_the_note_says_why():
    t = np.arange(20000) / 2000
    r = circular_correlation(np.sin(2 * np.pi * 50 * t) + 0.1 * noise(0))
    found = largest(pair_correlations(r, least_shifts(r, 24, 200)))
    note = correlation_note(r, found, 24)
    assert found > 0.1
    assert "of all lags" in note
    assert "less regular" in note


def test_the_note_tells_delays_that_meet_a_peak():
    r = circular_correlation(noise(1))
    assert "`delays='least'`" in correlation_note(r, 0.5, 24)
    assert correlation_note(r, 0.05, 24) == ""


def test_delays_without_room_and_loops_without_motion_are_refused():
    with refusal("range", "separation"):
        random_shifts(24, 1000, 42, rng=np.random.default_rng(0))
    with refusal("range", "separation"):
        least_shifts(circular_correlation(noise(0)), 24, 1000)
    with refusal("range", "stimulus"):
        circular_correlation(np.zeros(100))
