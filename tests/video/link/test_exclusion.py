"""Two whiskers that want the same lines, against what is likelier for both together."""

import numpy as np
import pytest

from vibrissa.video.link.chains import swap_moves
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.swap_moves import _Chains, best_lines
from vibrissa.video.link.chains.swaps import Swap
from vibrissa.video.link.chains.whisker_models import Model
from vibrissa.video.link.pad.pads import Lines

LEVER = np.array([0.8, 1.0, 1.1])
UNMOVED = np.zeros((2, 3))


def solution(places: list[np.ndarray]) -> Solution:
    """Lines at a place (T, 3) each in every frame, each one plain stretch, of a pad at rest."""
    count, frames = len(places), len(places[0])
    lines = Lines(
        pad=np.zeros(count * frames, int),
        turned=np.zeros(count * frames, bool),
        place=np.stack(places, axis=1).reshape(-1, 3),
        covariance=np.tile(0.01 * np.eye(3), (count * frames, 1, 1)),
        reach=np.tile([-1.0, 1.0], (count * frames, 1)),
        look=np.tile([3.0, 1.0], (count * frames, 1)),
    )
    frame, stretch = np.repeat(np.arange(frames), count), np.tile(np.arange(count), frames)
    return Solution(frames, frame, lines, np.arange(frame.size), np.zeros((frame.size, 2)), LEVER, stretch)


def whisker(place: float, keep: float = 0.9) -> Model:
    """At this place at all radii, from which it strays by 1°."""
    return Model(np.full(3, place), UNMOVED, np.eye(3), keep, 0.05, np.array([3.0, 1.0]), np.array([0.35, 0.25]))


@pytest.mark.parametrize("frames", [20, 60, 200])
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_lines_go_to_the_whisker_that_cannot_do_without_them(frames, order):
    """A whisker at 3° is as well off with a line at 1.2° as with one at 5.2°; one at 0° is not."""
    pad = solution([np.full((frames, 3), 1.2), np.full((frames, 3), 5.2)])
    models = [whisker(0.0), whisker(3.0)]
    pad.place([models[n] for n in order])
    pad.settle()
    best = best_lines(pad)
    for label, n in enumerate(order):
        np.testing.assert_array_equal(best[label] % 2, n)


@pytest.mark.parametrize("frames", [20, 60, 200, 800])
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_a_line_is_not_two_whiskers_however_long_it_lasts(frames, order):
    pad = solution([np.zeros((frames, 3))])
    models = [whisker(0.0), whisker(3.0)]
    pad.place([models[n] for n in order])
    pad.settle()
    chance = np.zeros(frames)
    for one in pad.labels:
        chance[one.seen] += one.chance
    assert chance.mean() == pytest.approx(1, abs=0.05)


def test_an_exchange_that_the_chains_do_not_confirm_is_not_made(monkeypatch):
    """Whatever the differences of two whiskers say."""
    rng = np.random.default_rng(1)
    pad = solution([rng.normal(0, 0.3, (80, 3)), rng.normal(4, 0.3, (80, 3))])
    pad.place([whisker(0.0), whisker(4.0)])
    pad.settle()
    before = best_lines(pad)
    late = Swap(np.arange(80), np.where(np.arange(80) < 40, 0.0, 1.0))
    monkeypatch.setattr(swap_moves, "swap_between", lambda *_, **__: late)
    swap_moves.unswap(pad, LEVER)
    np.testing.assert_array_equal(best_lines(pad), before)
    np.testing.assert_allclose(swap_moves.swap_doubt(pad, LEVER)[:, 40:], 0.5)


def test_two_chains_say_which_names_are_likelier():
    """Of two whiskers that stray slowly, 4° apart; in the second half names may be exchanged, or were."""
    rng = np.random.default_rng(1)
    stray = np.zeros((2, 120, 3))
    for t in range(1, 120):
        stray[:, t] = 0.9 * stray[:, t - 1] + rng.normal(0, 0.3, (2, 3))
    pad = solution([stray[0], 4 + stray[1]])
    pad.place([whisker(0.0), whisker(4.0)])
    lines = np.arange(240).reshape(120, 2).T
    crossed = np.where(np.arange(120) < 60, lines, lines[::-1])
    chains = _Chains(pad, LEVER)
    assert not chains.likelier((0, 1), lines, crossed)
    assert chains.likelier((0, 1), crossed, lines)
