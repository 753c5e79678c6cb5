"""The textures of a map: the gaps that are given, or random gratings, one for each seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Integers
from vibrissa.errors import FormatError
from vibrissa.texture.surface import DEPTH, Gaps, Reading, random_grating


@dataclass(frozen=True, kw_only=True)
class Gratings:
    """Random square-wave gratings; see :func:`vibrissa.texture.surface.random_grating`.

    Attributes
    ----------
    seed : (N,) array of int
        One for each grating, strictly ascending, from 0: equal seeds give equal gratings.
    length : float
        Length of each [m].
    reading : {"telegraph", "widths"}
        How widths are drawn: edges without memory, or Gaussian widths.
    mean_period : float
        Mean of one land and one gap together [m].
    depth : float
        Depth of the gaps [m].

    Raises
    ------
    InputError
        If the seeds are not whole numbers that ascend, or gratings as asked cannot be made.
    """

    seed: ArrayLike
    length: float
    reading: Reading = "telegraph"
    mean_period: float = 0.6e-3
    depth: float = DEPTH

    def __post_init__(self) -> None:
        seed = np.asarray(self.seed)
        whole = seed.ndim == 1 and seed.size > 0 and np.isfinite(seed).all() and np.all(seed == seed.astype(np.int64))
        if not whole or seed[0] < 0 or not np.all(np.diff(seed) > 0):
            rule = "must be a strictly ascending row of whole numbers from 0, none twice"
            raise FormatError("seeds", rule, seed.tolist())
        object.__setattr__(self, "seed", seed.astype(np.int64))
        self.drawn(int(seed[0]))

    @property
    def seeds(self) -> Integers:
        """The seeds, (N,)."""
        return np.asarray(self.seed, np.int64)

    def drawn(self, seed: int) -> Gaps:
        """The grating of a seed, which depends on nothing else.

        Parameters
        ----------
        seed : int
            From 0.

        Returns
        -------
        Gaps
            The grating.
        """
        rng = np.random.default_rng(seed)
        return random_grating(
            self.length, rng=rng, reading=self.reading, mean_period=self.mean_period, depth=self.depth
        )
