"""Names of whiskers exchanged where the whole movie speaks for it."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.video.link.chains.chain_kernel import LEAVES
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.swaps import Swap, Wandering, confusable, swap_of, swapped
from vibrissa.video.link.chains.whisker_models import EQUAL, Model, prior_spread, refit
from vibrissa.video.link.pad.phase import gains_at


def best_lines(solution: Solution) -> Integers:
    """Likeliest segment of each whisker in each frame (whisker, frame), −1 where it has probably none."""
    out = np.full((len(solution.labels), solution.frames), -1)
    for n, one in enumerate(solution.labels):
        order = np.argsort(one.chance, kind="stable")
        order = order[one.chance[order] > 0.4]
        out[n, solution.frame[one.seen[order]]] = one.seen[order]
    return out


def swap_between(
    solution: Solution, best: Integers, pair: tuple[int, int], lever: Array, cautious: bool = False
) -> Swap | None:
    """Where two whiskers may have changed names; cautiously: as far as it is sure."""
    a, b = best[pair[0]], best[pair[1]]
    frame = np.flatnonzero((a >= 0) & (b >= 0))
    if not frame.size:
        return None
    one, other = a[frame], b[frame]
    lines, models = solution.lines, [solution.labels[n].model for n in pair]
    gain = (models[0].gain + models[1].gain) / 2
    places = [lines.place[s] - solution.phase[s] @ gain for s in (one, other)]
    error = lines.covariance[np.stack([one, other])]
    keep = min(max(model.keep for model in models), 0.92)
    slow = np.diag(np.mean([model.slow for model in models], axis=0))
    learnt, usual = (models[0].spread + models[1].spread) / 2, prior_spread(lever)
    at_base = _at_base(learnt, usual) if solution.bases_cross else 0.0
    spread = learnt if cautious else usual + np.diag([at_base, 0.0, 0.0])
    known = Wandering(spread, slow, error, keep, not cautious)
    plain = sum(LEAVES * (solution.after[s[:-1]] == s[1:]) for s in (one, other))
    return swap_of(frame, places[0], places[1], lines.look[one] - lines.look[other], known, solution.phase[one], plain)


def _at_base(learnt: Array, usual: Array) -> float:
    """Variance at the inner radius that whiskers have there alone: where bases cross, lines begin on the other one."""
    over = (learnt / usual).diagonal()
    return float(usual[0, 0] * max(over[0] - max(over[1], over[2], 1.0), 0.0))


def unswap(solution: Solution, lever: Array) -> None:
    """Exchange probabilities of two whiskers in the frames in which they are likelier swapped.

    What their differences say is taken only if the two chains, each fitted to the lines that it has then, are likelier.

    Parameters
    ----------
    solution : Solution
        Its labels are changed.
    lever : (3,) array
        Expected gain of the pad's whiskers.
    """
    best, every, chains = best_lines(solution), np.arange(solution.frames), _Chains(solution, lever)
    for a, b in _meeting(solution, lever):
        # what has not changed since the last time is not done again
        key = _key(best, a, b)
        if key not in solution.decided:
            solution.decided[key] = swap_between(solution, best, (a, b), lever)
        found = solution.decided[key]
        if found is None:
            continue
        if swapped(found.chance).any():
            when = np.interp(every, found.frames, swapped(found.chance)) > 0.5
            exchanged = np.where(when, best[[b, a]], best[[a, b]])
            if chains.likelier((a, b), best[[a, b]], exchanged):
                _exchange(solution, (a, b), when)
                best[[a, b]] = exchanged


def keep_names(solution: Solution, lever: Array) -> None:
    """Let :func:`unswap` exchange no names until lines change."""
    best = best_lines(solution)
    solution.decided |= {_key(best, a, b): None for a, b in _meeting(solution, lever)}


def _meeting(solution: Solution, lever: Array) -> list[tuple[int, int]]:
    """Pairs of whiskers that are near enough to meet."""
    if len(solution.labels) < 2:
        return []
    return confusable(np.array([one.model.place for one in solution.labels]), prior_spread(lever))


def _key(best: Integers, a: int, b: int) -> tuple[int, int, int]:
    """What decides whether two whiskers are exchanged: their lines."""
    return a, b, hash((best[a].tobytes(), best[b].tobytes()))


def swap_doubt(solution: Solution, lever: Array) -> Array:
    """Probability that the name is another one's, (whisker, frame), as far as evidence is independent.

    Where the differences of two whiskers speak for an exchange that their chains do not confirm, it is one half.

    Parameters
    ----------
    solution : Solution
        Of which :func:`unswap` has been taken.
    lever : (3,) array
        Expected gain of the pad's whiskers.
    """
    doubt = np.zeros((len(solution.labels), solution.frames))
    best, every = best_lines(solution), np.arange(solution.frames)
    for a, b in _meeting(solution, lever):
        found = swap_between(solution, best, (a, b), lever, cautious=True)
        if found is not None:
            # nothing is known between the last frame before a meeting and the first after it but that it is one of them
            left = np.interp(every, found.frames, np.minimum(found.chance, 0.5))
            doubt[[a, b]] = 1 - (1 - doubt[[a, b]]) * (1 - left)
    return doubt


def _exchange(solution: Solution, pair: tuple[int, int], when: Mask) -> None:
    """Exchange the probabilities of two whiskers in some frames."""
    one, other = (solution.labels[n] for n in pair)
    chance = np.zeros((2, solution.frame.size))
    for n, label in enumerate((one, other)):
        chance[n, label.seen] = label.chance
    now = when[solution.frame]
    chance = np.where(now, chance[::-1], chance)
    for n, label in enumerate((one, other)):
        seen = np.flatnonzero(chance[n] > 0.01)
        x = np.zeros((seen.size, 3))
        label.seen, label.chance, label.x = seen, chance[n, seen], x


class _Chains:
    """How likely two chains are, each fitted to its lines and free of all others."""

    def __init__(self, solution: Solution, lever: Array) -> None:
        self.solution, self.lever = solution, lever
        self.known: dict[tuple[int, int], float] = {}

    def likelier(self, pair: tuple[int, int], lines: Integers, exchanged: Integers) -> bool:
        """Whether two whiskers are likelier with ``exchanged`` lines (2, T) than with ``lines``; −1 for none."""
        now, then = (sum(self._alone(n, one) for n, one in zip(pair, both, strict=True)) for both in (lines, exchanged))
        return then > now

    def _alone(self, number: int, lines: Integers) -> float:
        """Logarithm of the chance of one chain, and of the gain it is fitted with."""
        key = number, hash(lines.tobytes())
        if key not in self.known:
            self.known[key] = self._chance(self.solution.labels[number].model, lines[lines >= 0])
        return self.known[key]

    def _chance(self, model: Model, seen: Integers) -> float:
        solution, lever = self.solution, self.lever
        model, expected = model._replace(course=None), gains_at(model.place[1:2], solution.along).T * lever
        for _ in range(2):  # the second time with the spread that the first has found
            model = refit(model, solution.lines, seen, np.ones(seen.size), solution.phase, solution.frame, expected)
        off = (model.gain - expected) / (EQUAL * lever)
        return solution.log_chance(model, seen) - 0.5 * float((off**2).sum())
