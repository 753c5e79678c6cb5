"""The backward half: movie → profile → modal amplitudes, envelope, resonance and damping."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.measures.whisk_cycle import stretches
from vibrissa.mechanics.inverse.decomposition import Method, decompose
from vibrissa.mechanics.inverse.resonance import fit_modes, fittable, folded
from vibrissa.quantities import dataset, measured
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.signals.frame_numbers import frame_numbers
from vibrissa.video.io.movie import read_blocks

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.modes.basis import Modes
    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.whisker import Whisker


def still_of(path: Path) -> xr.Dataset:
    """First frame of a movie: ``image`` (image_row, image_column) [grey levels].

    Parameters
    ----------
    path : Path
        The movie.

    Returns
    -------
    Dataset
        One image.
    """
    image = next(iter(read_blocks(path, 1)))[0]
    rows, columns = image.shape
    return dataset(image_row=np.arange(rows), image_column=np.arange(columns), image=image)


def followed(profile: xr.Dataset) -> xr.Dataset:
    """How many frames each whisker was followed in, and how far along the shaft.

    Parameters
    ----------
    profile : Dataset
        From :func:`vibrissa.video.tracking.track`.

    Returns
    -------
    Dataset
        ``frames_followed``, ``frames`` and ``median_length`` [m] (whisker).
    """
    seen = measured(profile)
    frames = np.asarray(seen.any(axis=2))
    reach = np.where(seen, profile.arc_length.values[:, None, :], -np.inf).max(axis=2)
    length = [np.median(one[ok]) if ok.any() else np.nan for one, ok in zip(reach, frames, strict=True)]
    return dataset(
        whisker=profile.whisker.values,
        frames=np.full(len(frames), frames.shape[1]),
        frames_followed=frames.sum(axis=1),
        median_length=np.array(length),
    )


def analyse(
    profile: xr.Dataset,
    whisker: Whisker,
    contact: float,
    *,
    n_modes: int = 3,
    method: Method = "least-squares",
    modes: Modes = "straight",
    posture: Posture | None = None,
) -> dict[str, xr.Dataset]:
    """Modal amplitudes of one tracked whisker, their envelopes, and resonances with white forcing assumed.

    Parameters
    ----------
    profile : Dataset
        One whisker.
    whisker, contact, n_modes, method, modes, posture
        As in :func:`vibrissa.mechanics.inverse.decomposition.decompose`.

    Returns
    -------
    dict of Datasets
        ``modal`` with ``envelope`` and ``phase``; ``resonance_white`` and ``spectra_white`` (Eq. 5). Where frames were
        lost there are no envelopes or resonances, and the attribute ``left_out`` of ``modal`` says so.
    """
    modal = modal_amplitudes(profile, whisker, contact, n_modes=n_modes, method=method, modes=modes, posture=posture)
    if "left_out" in modal.attrs:
        return {"modal": modal}
    resonance, spectra = fit_modes(modal, modal.expected_frequency.values)
    return {"modal": modal, "resonance_white": resonance, "spectra_white": spectra}


def modal_amplitudes(
    profile: xr.Dataset,
    whisker: Whisker,
    contact: float,
    *,
    n_modes: int = 3,
    method: Method = "least-squares",
    modes: Modes = "straight",
    posture: Posture | None = None,
) -> xr.Dataset:
    """Modal amplitudes of one tracked whisker, their envelopes and phases, and the resonances of its cone.

    Parameters
    ----------
    profile, whisker, contact, n_modes, method, modes, posture
        As in :func:`analyse`.

    Returns
    -------
    Dataset
        As of :func:`vibrissa.mechanics.inverse.decomposition.decompose`, with ``expected_frequency`` (mode) [Hz] and,
        unless frames were lost, ``envelope`` [m] and ``phase`` (mode, time); else the attribute ``left_out``.
    """
    modal = decompose(profile, whisker, contact, n_modes=n_modes, method=method, modes=modes, posture=posture)
    expected = modal.kappa.values / (2 * np.pi * whisker.timescale)
    modal = modal.merge(dataset(mode=modal.mode.values, expected_frequency=expected), combine_attrs="override")
    seen = np.isfinite(modal.mode_displacement.values).all(axis=0)
    if not seen.all():
        modal.attrs["left_out"] = f"envelopes and resonances: {_lost(seen, profile, expected)}"
        return modal
    envelope, phase = analytic_envelope(modal.mode_displacement.values)
    shown: dict[str, Any] = {"envelope": whisker.length * envelope, "phase": phase}
    labelled = dataset(mode=modal.mode.values, time=modal.time.values, **shown)
    return modal.merge(labelled, combine_attrs="override")


def _lost(seen: Mask, profile: xr.Dataset, expected: Array) -> str:
    """How many frames were lost, and the longest stretch in which none was, if a resonance [Hz] can be fitted there."""
    lost = f"{np.count_nonzero(~seen)} of {seen.size} frames were lost"
    if not seen.any():
        return lost
    start, stop = max(stretches(seen), key=lambda one: one[1] - one[0])
    first, last = frame_numbers(profile)[[start, stop - 1]]
    stretch = f"{lost}; the longest stretch without a loss is frames {first} to {last}"
    rate = 1 / float(np.median(np.diff(profile.time.values)))
    if expected.min() >= rate / 2:
        return f"{stretch}; {folded(int(expected.argmin()), float(expected.min()), rate)}"
    if not fittable(stop - start, rate, expected):
        return f"{stretch}, too short for the fits"
    if "movie" not in profile.attrs or "movie_begins" in profile.attrs:  # a sweep of a table is tracked whole
        return stretch
    return f"{stretch}: track it by itself (start {first}, stop {last + 1})"
