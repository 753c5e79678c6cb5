"""The backward half: movie → profile → modal amplitudes, envelope, resonance and damping."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.mechanics.decomposition import Method, decompose
from vibrissa.mechanics.modes import resonances
from vibrissa.mechanics.resonance import fit_modes
from vibrissa.quantities import dataset, measured_sd
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.settings import MovieFile
from vibrissa.video.movie import open_movie, read_blocks
from vibrissa.video.tracking import Calibration, track

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.whisker import Whisker

Progress = Callable[[str, int, int], None]
Frames = NDArray[np.uint8] | NDArray[np.uint16]


def counted(blocks: Iterable[Frames], stage: str, total: int, progress: Progress) -> Iterator[Frames]:
    """Pass blocks of frames on, and tell the progress after each."""
    done = 0
    for block in blocks:
        yield block
        done += len(block)
        progress(stage, done, total)


def track_file(movie: MovieFile, folder: Path, progress: Progress) -> xr.Dataset:
    """Track the whiskers of a movie file, as :func:`vibrissa.video.tracking.track` does.

    Parameters
    ----------
    movie : MovieFile
        The file, its calibration and its seeds.
    folder : Path
        Where a relative path starts.
    progress : callable
        Called with (stage, frames done, frames in all).

    Returns
    -------
    Dataset
        ``profile``, with the whiskers' ``names`` (JSON) in its attributes where they have some.
    """
    path = folder / movie.path
    total = open_movie(path).frame_count or 0
    profile = track(
        lambda: counted(read_blocks(path), "tracking", total, progress),
        seeds=movie.seeds,
        calibration=Calibration(frame_rate=movie.frame_rate, pixel_size=movie.pixel_size),
        skin=movie.skin,
        polarity=movie.polarity,
        base=movie.base,
        background=_beside(movie.background, folder),
        region=movie.region,
        search=movie.search,
        threshold=movie.threshold,
        estimator=movie.estimator,
        whisking=movie.whisking,
    )
    if movie.names:
        profile.attrs["names"] = json.dumps(movie.names)
    return profile


def _beside(background: str, folder: Path) -> str | Path:
    """The background of a movie: a word, or a file relative to the study's folder."""
    return background if background in ("space", "mean") else folder / background


def still_of(path: Path) -> xr.Dataset:
    """First frame of a movie: ``image`` (row, column) [grey levels]."""
    image = next(iter(read_blocks(path, 1)))[0]
    rows, columns = image.shape
    return dataset(row=np.arange(rows), column=np.arange(columns), image=image)


def followed(profile: xr.Dataset) -> xr.Dataset:
    """How many frames each whisker was followed in, and how far along the shaft.

    Returns
    -------
    Dataset
        ``frames_followed``, ``frames`` and ``median_length`` [m] (whisker).
    """
    seen = np.isfinite(measured_sd(profile).values)
    frames = seen.any(axis=2)
    reach = np.where(seen, profile.arc_length.values[:, None, :], -np.inf).max(axis=2)
    length = [np.median(one[ok]) if ok.any() else np.nan for one, ok in zip(reach, frames, strict=True)]
    return dataset(
        whisker=profile.whisker.values,
        frames=np.full(len(frames), frames.shape[1]),
        frames_followed=frames.sum(axis=1),
        median_length=np.array(length),
    )


def analyse(
    profile: xr.Dataset, whisker: Whisker, contact: float, *, n_modes: int = 3, method: Method = "least-squares"
) -> dict[str, xr.Dataset]:
    """Modal amplitudes of one tracked whisker, their envelopes, and resonances with the forcing taken for white.

    Parameters
    ----------
    profile : Dataset
        One whisker.
    whisker, contact, n_modes, method
        As in :func:`vibrissa.mechanics.decomposition.decompose`.

    Returns
    -------
    dict of Datasets
        ``modal`` with ``envelope`` and ``phase``; ``resonance_white`` and ``spectra_white`` (Eq. 5). Where frames were
        lost there are no envelopes or resonances, and the attribute ``left_out`` of ``modal`` says so.
    """
    modal = decompose(profile, whisker, contact, n_modes=n_modes, method=method)
    lost = int(np.count_nonzero(~np.isfinite(modal.mode_displacement.values).all(axis=0)))
    if lost:
        modal.attrs["left_out"] = f"envelopes and resonances: {lost} of {modal.sizes['time']} frames were lost"
        return {"modal": modal}
    envelope, phase = analytic_envelope(modal.mode_displacement.values)
    labelled = dataset(mode=modal.mode.values, time=modal.time.values, envelope=envelope, phase=phase)
    modal = modal.merge(labelled, combine_attrs="override")
    expected = resonances(whisker, contact, n_modes).resonant_frequency.values
    resonance, spectra = fit_modes(modal, expected)
    return {"modal": modal, "resonance_white": resonance, "spectra_white": spectra}
