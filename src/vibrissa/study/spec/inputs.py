"""Files that a study reads."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.study.spec.recorded_sweeps import read_sweeps
from vibrissa.study.spec.textures import TextureFile

if TYPE_CHECKING:
    from vibrissa.study.spec.settings import Study


def input_files(study: Study) -> dict[str, Path]:
    """Every file that a study names, by the name it has there; those of its table of sweeps too.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    dict of Path
        By the name in the study.
    """
    return {name: study.folder / name for name in sorted(set(_names(study)))}


def _names(study: Study) -> Iterator[str]:
    if study.movie is not None:
        yield study.movie.path
        if study.movie.background not in ("space", "mean"):
            yield study.movie.background
    if isinstance(study.texture, TextureFile):
        yield study.texture.file
    for signal in study.base_signal:
        yield signal.path
        yield from filter(None, [signal.texture])
    for recording in study.neural:
        yield recording.spikes
        yield recording.stimulus
    if study.sweeps is not None:
        yield study.sweeps
        for entry in read_sweeps(study.folder / study.sweeps):
            within = Path(study.sweeps).parent
            yield from (str(within / name) for name in (entry.movie, entry.track, entry.texture) if name)
