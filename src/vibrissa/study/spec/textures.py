"""The texture of a study: a random grating, or a file of gaps or of any surface."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibrissa.errors import InputError
from vibrissa.mechanics.scan.relief_prediction import ReliefPrediction, predict_relief
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict
from vibrissa.texture.io import read_texture
from vibrissa.texture.surface import Gaps, random_grating

if TYPE_CHECKING:
    from vibrissa.mechanics.scan.scan_settings import Scan
    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.texture.relief import HeightProfile
    from vibrissa.whisker import Whisker

_ARGUMENT = re.compile(r"`(\w+)(?:=([^`]*))?`")  # as the package writes it in a remedy


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

    def made(self, folder: Path, tell: Callable[[str], None] = lambda note: None) -> Gaps:
        """Draw the gaps; there is nothing to report.

        Parameters
        ----------
        folder : Path
            Not used.
        tell : callable
            Not called.

        Returns
        -------
        Gaps
            The gaps.
        """
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

    def made(self, folder: Path, tell: Callable[[str], None] = lambda note: None) -> Gaps | HeightProfile:
        """Read the surface; ``tell`` takes one line for each decision about the file.

        Parameters
        ----------
        folder : Path
            Where relative paths start.
        tell : callable
            Called with a line for each decision.

        Returns
        -------
        Gaps or HeightProfile
            The surface.
        """
        how: dict[str, Any] = {name: value for name, value in vars(self).items() if name != "file"}
        try:
            return read_texture(folder / self.file, tell=tell, **how)
        except InputError as error:
            raise _in_keys(error) from error


def _in_keys(error: InputError) -> InputError:
    """A refusal of a surface in the words of a study file: an argument, such as `level='line'`, is a key."""

    def key(found: re.Match[str]) -> str:
        value = "true" if found[1] in ("fill", "flip") else found[2]
        return found[1] if value is None else f"{found[1]} = {value}"

    remedy, named = _ARGUMENT.subn(key, error.remedy)
    return type(error)(error.quantity, error.rule, error.value, f"in [texture] {remedy}" if named else remedy)


def predict_surface(
    whisker: Whisker, posture: Posture, texture: Gaps | HeightProfile, scan: Scan, *, n_modes: int = 12
) -> Prediction | ReliefPrediction:
    """Prepare the prediction for gaps, or for any heights.

    Parameters
    ----------
    whisker, posture, scan, n_modes
        As :func:`vibrissa.mechanics.scan.texture_prediction.predict` takes them.
    texture : Gaps or HeightProfile
        The surface.

    Returns
    -------
    Prediction or ReliefPrediction
        The motion, at any time.

    Raises
    ------
    InputError, ConvergenceError
        If the posture cannot cross the surface.
    """
    if isinstance(texture, Gaps):
        return predict(whisker, posture, texture, scan, n_modes=n_modes)
    return predict_relief(whisker, posture, texture, scan, n_modes=n_modes)
