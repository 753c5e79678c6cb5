"""Probabilities of a whisker's lines against all ways in which it may be seen, one by one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_t

from vibrissa.video.link.chains.chain_kernel import LEAVES, RETURN, STAY, TAILS, chances, edges, log_chance, near
from vibrissa.video.link.pad.common_swing import REACH

FRAMES = 7


def candidates(rng: np.random.Generator) -> dict[str, np.ndarray | float]:
    """One or two candidates in most of the frames, none in others."""
    frame = np.sort(rng.choice(np.repeat(np.arange(FRAMES), 2), 8, replace=False))
    pairs = [(i, j) for j in range(8) for i in range(j) if 0 < frame[j] - frame[i] <= REACH]
    start, stop = np.array(pairs).T
    return {
        "frame": frame,
        "gain": rng.normal(2, 3, 8),
        "again": rng.normal(-3, 3, 8),
        "leaves": rng.normal(-4, 2, 8),
        "start": start,
        "stop": stop,
        "step": np.exp(rng.normal(-2, 3, start.size)),
        "missed": -1.5,
    }


def one_by_one(frame, gain, again, leaves, start, stop, step, missed) -> tuple[np.ndarray, np.ndarray, float]:
    """Weight of all ways that lead through each candidate, of those that do not, and of all."""
    ways: list[tuple[float, tuple[int, ...]]] = []

    def lost(t: int, weight: float, seen: tuple[int, ...]) -> None:
        if t == FRAMES:
            ways.append((weight, seen))
            return
        lost(t + 1, weight * np.exp(STAY), seen)
        for c in np.flatnonzero(frame == t):
            there(c, weight * np.exp(RETURN + again[c] + gain[c]), (*seen, c))

    def there(c: int, weight: float, seen: tuple[int, ...]) -> None:
        lost(frame[c] + 1, weight * np.exp(leaves[c]), seen)
        for e in np.flatnonzero(start == c):
            j = stop[e]
            over = np.exp(missed * (frame[j] - frame[c] - 1) + gain[j])
            there(j, weight * step[e] * over, (*seen, j))

    lost(0, 1.0, ())
    total = sum(weight for weight, _ in ways)
    through = [sum(weight for weight, seen in ways if c in seen) for c in range(frame.size)]
    past = [sum(weight for weight, seen in ways if c not in seen) for c in range(frame.size)]
    return np.array(through), np.array(past), total


@pytest.mark.parametrize("seed", range(5))
def test_a_candidate_is_as_probable_as_all_ways_that_lead_through_it(seed):
    given = candidates(np.random.default_rng(seed))
    chance, odds = chances(FRAMES, **given)
    through, past, total = one_by_one(**given)
    np.testing.assert_allclose(chance, through / total, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(odds, np.log(through / past), rtol=1e-9, atol=1e-9)
    assert log_chance(FRAMES, **given) == pytest.approx(np.log(total))


def test_odds_tell_how_sure_a_chain_is_where_the_probability_is_one():
    given = candidates(np.random.default_rng(0))
    given["gain"][3] += 80  # e^80 is 5 · 10^34
    through, past, _ = one_by_one(**given)
    chance, odds = chances(FRAMES, **given)
    assert chance[3] == pytest.approx(1, abs=1e-12)  # of which no odds could be made
    assert odds[3] == pytest.approx(np.log(through[3] / past[3]))


def test_a_long_movie_neither_overflows_nor_underflows():
    n = 5000
    flat, each = np.ones(n), np.arange(n)
    steps = each[:-1], each[1:], 1e-30 * flat[1:]
    # a chain of lines each worth e^(90 − 69), and e^(30 − 69), against no line
    np.testing.assert_allclose(chances(n, each, 90 * flat, -300 * flat, -200 * flat, *steps, -1.0)[0], 1, rtol=1e-9)
    np.testing.assert_allclose(chances(n, each, 30 * flat, -300 * flat, -200 * flat, *steps, -1.0)[0], 0, atol=1e-9)


def test_steps_have_the_density_of_a_process_that_forgets():
    rng = np.random.default_rng(3)
    spread, keep = np.diag([1.0, 2.0, 0.5]) + 0.2, 0.8
    x, cov = rng.normal(size=(3, 3)), np.array([np.diag(rng.uniform(0.1, 1, 3)) + 0.05 for _ in range(3)])
    when, none = np.array([0, 2, 2]), np.full(3, -1)
    start, stop, step = edges(np.arange(3), when, x, cov, spread, keep, none, none)
    assert list(zip(start, stop, strict=True)) == [(0, 1), (0, 2)]
    expected = [
        multivariate_t(keep**2 * x[0], spread * (1 - keep**4) + cov[j] + keep**4 * cov[0], TAILS).pdf(x[j])
        for j in (1, 2)
    ]
    # of a Gaussian's height in the middle
    height = (2 * np.pi) ** -1.5 / multivariate_t(np.zeros(3), np.eye(3), TAILS).pdf(np.zeros(3))
    np.testing.assert_allclose(step, height * np.array(expected), rtol=1e-12)
    alone = [multivariate_t(np.zeros(3), spread + cov[i], TAILS).logpdf(x[i]) for i in range(3)]
    which, density = near(x, cov, spread, 50.0)
    assert which.tolist() == [0, 1, 2]
    np.testing.assert_allclose(density, np.log(height) + alone, rtol=1e-12)
    # the name leaves a plain stretch: from line 0, which line 1 plainly follows, to line 2
    _, _, torn = edges(np.arange(3), when, x, cov, spread, keep, np.array([-1, 0, -1]), np.array([1, -1, -1]))
    np.testing.assert_allclose(torn / step, [1.0, np.exp(-LEAVES)], rtol=1e-12)


def test_what_is_near_a_whisker_is_what_its_density_says():
    rng = np.random.default_rng(5)
    spread, gate = np.diag([1.0, 2.0, 0.5]) + 0.2, 4.0
    x, cov = rng.normal(0, 6, (400, 3)), np.array([np.diag(rng.uniform(0.1, 1, 3)) + 0.05 for _ in range(400)])
    below = [
        t.logpdf(np.zeros(3)) - t.logpdf(one)
        for one, t in zip(x, (multivariate_t(np.zeros(3), spread + one, TAILS) for one in cov), strict=True)
    ]
    expected = np.flatnonzero(np.array(below) < gate)
    assert 20 < expected.size < 380
    np.testing.assert_array_equal(near(x, cov, spread, gate)[0], expected)
    assert near(x[:0], cov[:0], spread, gate)[0].size == 0
