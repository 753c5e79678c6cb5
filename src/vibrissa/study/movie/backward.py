"""The backward half: movie → profile → modal amplitudes, envelope, resonance and damping."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Frames
from vibrissa.errors import ConflictError, MissingError
from vibrissa.mechanics.inverse.decomposition import Method, decompose
from vibrissa.mechanics.inverse.resonance import fit_modes
from vibrissa.quantities import dataset, measured
from vibrissa.quantities.kinds import Progress
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.spec.settings import MovieFile
from vibrissa.video.checks.gop_artifact import GopArtifactWatch
from vibrissa.video.checks.trial_led import led_frame, with_led
from vibrissa.video.io.about import IN_COLOUR, Movie
from vibrissa.video.io.container import key_frames
from vibrissa.video.io.frame_times import FrameTimes
from vibrissa.video.io.movie import frame_times_of, frames_within, open_movie, read_blocks, sure_frame_times
from vibrissa.video.profile.ends import ends
from vibrissa.video.profile.missing_frames import without_frames
from vibrissa.video.tracking import Calibration, numbered_from, track

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.modes.basis import Modes
    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.whisker import Whisker

TRACKED = (  # settings of a movie that the tracker takes as they are
    "seeds", "skin", "polarity", "base", "region", "search", "threshold", "estimator", "node_spacing", "whisking",
)  # fmt: skip


def counted(blocks: Iterable[Frames], stage: str, total: int, progress: Progress) -> Iterator[Frames]:
    """Pass blocks of frames on; report the progress before the first and after each.

    Parameters
    ----------
    blocks : iterable of arrays
        Frames (T, height, width).
    stage : str
        Name under which progress is reported.
    total : int
        Frames in all.
    progress : callable
        Called with (stage, done, total).

    Yields
    ------
    array
        The same blocks.
    """
    done = 0
    progress(stage, done, total)
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
        ``profile``, with the whiskers' ``names`` (JSON) in its attributes where they have some, and ``remarks`` (JSON)
        on the movie where there are any; with skin and contact where the substrate is given, and ``led_frame``
        where a lamp is. With missing frames as of
        :func:`vibrissa.video.profile.missing_frames.without_frames`. Of a part of the movie also ``first_frame`` and
        ``last_frame``; time counts from the movie's first frame.

    Raises
    ------
    InputError
        If the movie cannot be read or tracked, or a part of it is asked for that it does not have.
    """
    path = folder / movie.path
    about = open_movie(path)
    times = frame_times_of(path) if movie.drop_frames is None else sure_frame_times(path)
    part = movie.start != 0 or movie.stop is not None
    if part and movie.whisking is not None:
        raise ConflictError("start, stop", "must be left out with marks of whisking", (movie.start, movie.stop))
    count = frames_within(about, movie.start, movie.stop) if part else about.frame_count

    def blocks(stage: str) -> Iterator[Frames]:
        read = read_blocks(path, start=movie.start, stop=movie.stop, drop_frames=movie.drop_frames)
        return counted(read, stage, count, progress)

    calibration = Calibration(frame_rate=_frame_rate(movie, about), pixel_size=movie.pixel_size)
    watched = _Watched(about, calibration.frame_rate, times, movie.drop_frames is not None)
    background = movie.background if movie.background in ("space", "mean") else folder / movie.background
    profile = track(
        lambda: watched.see(blocks("tracking")),
        calibration=calibration,
        background=background,
        **{name: getattr(movie, name) for name in TRACKED},
    )
    profile = numbered_from(profile, movie.start) if part else profile
    if movie.drop_frames is not None and times is not None:
        profile = without_frames(profile, times.missing)
    if movie.names:
        profile.attrs["names"] = json.dumps(movie.names)
    if remarks := watched.remarks():
        profile.attrs["remarks"] = json.dumps(remarks, ensure_ascii=False)
    if movie.lamp is not None:
        lamp = None if movie.lamp == "find" else movie.lamp
        profile = with_led(profile, led_frame(blocks("lamp"), lamp))
    return profile if movie.substrate is None else with_ends(profile, movie)


def _frame_rate(movie: MovieFile, about: Movie) -> float:
    """Rate of acquisition [Hz]: as given, else that of the camera's header."""
    if movie.frame_rate is None and not np.isfinite(about.frame_rate):
        remedy = "give the camera's rate, not the movie's playback rate"
        raise MissingError("frame_rate", f"must be given: {about.path} does not hold it", remedy=remedy)
    return about.frame_rate if movie.frame_rate is None else movie.frame_rate


class _Watched:
    """What a movie shows while it passes that its reader should know."""

    def __init__(self, about: Movie, frame_rate: float, times: FrameTimes | None, kept: bool) -> None:
        self._about, self._frame_rate, self._times, self._kept = about, frame_rate, times, kept
        self._pumping: GopArtifactWatch | None = None

    def see(self, blocks: Iterable[Frames]) -> Iterator[Frames]:
        """Pass blocks of frames on; those of a lossy codec are watched."""
        if self._about.lossy:
            keys = key_frames(self._about.path)
            keys = self._times.slots[keys] if self._times is not None and self._kept else keys
            self._pumping = GopArtifactWatch(self._frame_rate, keys)
        for block in blocks:
            if self._pumping is not None:
                self._pumping.see(block)
            yield block

    def remarks(self) -> list[str]:
        """One sentence each."""
        rate, remarks = self._about.frame_rate, []
        if np.isfinite(rate) and not np.isclose(rate, self._frame_rate):
            remarks.append(f"the camera's header has {rate:g} frames/s, not {self._frame_rate:g}")
        if self._about.colour:
            remarks.append(IN_COLOUR)
        codec = self._about.codec
        unchecked = "" if self._about.checksums else "has no checksums: damaged bytes may pass unseen"
        if self._about.lossy:
            remarks.append(" and ".join(filter(None, [f"{codec} may have altered the grey levels", unchecked])))
            remarks[-1] += "; record without loss, FFV1 best"
        elif unchecked:
            remarks.append(f"{codec} {unchecked}")
        if self._times is not None:
            remarks += self._times.remarks(self._kept)
        pumping = self._pumping.remark() if self._pumping else None
        return [*remarks, *filter(None, [pumping])]


def with_ends(profile: xr.Dataset, movie: MovieFile) -> xr.Dataset:
    """The profile with the skin and the contact of every whisker.

    They are those that :func:`vibrissa.video.profile.ends.ends` finds.

    The attribute ``rejected`` (JSON) holds a reason for each whisker whose contact is inconsistent with the substrate,
    "" for the others.

    Parameters
    ----------
    profile : Dataset
        From :func:`vibrissa.video.tracking.track`.
    movie : MovieFile
        Its substrate, pixel size and length of the cone.

    Returns
    -------
    Dataset
        With the variables of that function by ``whisker``.

    Raises
    ------
    InputError
        If the substrate is not given.
    """
    import xarray as xr

    if movie.substrate is None:
        raise MissingError("substrate", "must be given", remedy="two points of the substrate's line")
    (a, b), size = movie.substrate, movie.pixel_size
    line = (a[0] * size, a[1] * size), (b[0] * size, b[1] * size)
    how: dict[str, Any] = {"method": "cone" if movie.whisker_length else "paper2014"}
    how["whisker_length"] = movie.whisker_length
    found = [ends(profile.isel(whisker=w), line, **how) for w in range(profile.sizes["whisker"])]
    both = xr.concat(found, dim=profile.whisker, combine_attrs="drop_conflicts")
    rejected = json.dumps([one.attrs["rejected"] for one in found])
    attrs = {"rejected": rejected, "contact_from": how["method"], "substrate": found[0].attrs["substrate"]}
    return profile.merge(both).assign_attrs(attrs)


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
    """Modal amplitudes of one tracked whisker, their envelopes, and resonances with the forcing taken for white.

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
    lost = int(np.count_nonzero(~np.isfinite(modal.mode_displacement.values).all(axis=0)))
    if lost:
        modal.attrs["left_out"] = f"envelopes and resonances: {lost} of {modal.sizes['time']} frames were lost"
        return modal
    envelope, phase = analytic_envelope(modal.mode_displacement.values)
    shown: dict[str, Any] = {"envelope": whisker.length * envelope, "phase": phase}
    labelled = dataset(mode=modal.mode.values, time=modal.time.values, **shown)
    return modal.merge(labelled, combine_attrs="override")
