"""Files that a study reads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.study.spec.recorded_sweeps import read_sweeps
from vibrissa.study.spec.textures import TextureFile
from vibrissa.video.follow.background import OF_THE_MOVIE
from vibrissa.video.foreign.whisk_files import measurements_beside
from vibrissa.video.io import photron

if TYPE_CHECKING:
    from vibrissa.study.spec.settings import Study


def input_files(study: Study) -> dict[str, Path]:
    """Every file that a study reads, by the name it has there; those of its table of sweeps too.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    dict of Path
        By the name in the study.
    """
    return dict(sorted(with_companions(study.folder, _names(study)).items()))


def with_companions(folder: Path, names: Iterable[str]) -> dict[str, Path]:
    """Files that are named, and those beside them that are read with them.

    These are the other file of a Photron movie (``.mraw``, ``.cih`` or ``.cihx``), and WHISK's ``.measurements``.

    Parameters
    ----------
    folder : Path
        Where relative paths start.
    names : iterable of str
        As the user gives them.

    Returns
    -------
    dict of Path
        By the name; of a file that is not named, that which it would have.
    """
    found = {}
    for name in names:
        found[name] = folder / name
        found |= {str(Path(name).with_name(other.name)): other for other in _companions(folder / name)}
    return found


def _companions(path: Path) -> list[Path]:
    if path.suffix.lower() in photron.SUFFIXES:
        return [one for one in photron.pair(path) if one not in (None, path)]
    return list(filter(None, [measurements_beside(path)]))


def _names(study: Study) -> Iterator[str]:
    if study.movie is not None:
        yield study.movie.path
        if study.movie.background not in OF_THE_MOVIE:
            yield study.movie.background
        if study.movie.head is not None and study.movie.head != "find":
            yield study.movie.head
    if isinstance(study.texture, TextureFile):
        yield study.texture.file
    for signal in study.base_signal:
        yield signal.path
        yield from filter(None, [signal.texture])
    for recording in study.neural:
        yield recording.spikes
        yield recording.stimulus
        yield from filter(None, [recording.kept, recording.trial_table_file(study.folder)])
        sidecar, kind = f"{recording.stimulus}.json", Path(recording.stimulus).suffix.lower()
        if kind in (".wav", ".npy") or (kind == ".csv" and (study.folder / sidecar).is_file()):
            yield sidecar
    if study.sweeps is not None:
        yield study.sweeps
        for entry in read_sweeps(study.folder / study.sweeps):
            within = Path(study.sweeps).parent
            yield from (str(within / name) for name in (entry.movie, entry.track, entry.texture) if name)
