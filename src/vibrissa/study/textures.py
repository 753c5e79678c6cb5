"""The texture of a study: a random grating, or a file of gaps or of any surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from vibrissa.texture.io import read_texture
from vibrissa.texture.surface import Troughs, random_grating

if TYPE_CHECKING:
    from vibrissa.texture.relief import Relief


@dataclass(frozen=True, kw_only=True)
class Grating:
    """A random square-wave grating; see :func:`vibrissa.texture.surface.random_grating`.

    Attributes
    ----------
    length : float
        Length of the grating [m].
    seed : int
        Of its edges: equal seeds give equal gratings.
    reading : {"telegraph", "widths"}
        How widths are drawn: edges without memory, or Gaussian widths.
    mean_period : float
        Mean of one land and one gap together [m].
    depth : float
        Depth of the gaps [m].
    """

    length: float
    seed: int = 0
    reading: Literal["telegraph", "widths"] = "telegraph"
    mean_period: float = 0.6e-3
    depth: float = 35e-6

    def made(self, folder: Path, tell: Callable[[str], None] = lambda note: None) -> Troughs:
        """The gaps; nothing is to be told of them."""
        rng = np.random.default_rng(self.seed)
        how = {"mean_period": self.mean_period, "depth": self.depth}
        return random_grating(self.length, rng=rng, reading=self.reading, **how)


@dataclass(frozen=True, kw_only=True)
class TextureFile:
    """A table of gaps or any surface; see :func:`vibrissa.texture.io.read_texture`.

    Attributes
    ----------
    file : str
        Table of gaps or any surface, relative to the study file.
    line, part, x_unit, z_unit, fill, level
        What the file leaves open: the line of a map, the part that is wanted [m], units, holes, tilt.
    flip : bool
        Whether what comes last in the file meets the contact first.
    """

    file: str
    line: str | None = None
    part: tuple[float, float] | None = None
    x_unit: str | None = None
    z_unit: str | None = None
    fill: bool = False
    level: Literal["line", "none"] | None = None
    flip: bool = False

    def made(self, folder: Path, tell: Callable[[str], None] = lambda note: None) -> Troughs | Relief:
        """The surface that the file holds; ``tell`` takes what was decided on the way, one line each."""
        return read_texture(
            folder / self.file,
            flip=self.flip,
            tell=tell,
            line=self.line,
            part=self.part,
            x_unit=self.x_unit,
            z_unit=self.z_unit,
            fill=self.fill,
            level=self.level,
        )
