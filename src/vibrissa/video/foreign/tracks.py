"""Whiskers tracked by other programs: any of their files, read as a profile."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal, cast

from vibrissa.errors import ConflictError, FormatError, MissingError
from vibrissa.files import existing
from vibrissa.video.foreign import whisk_files
from vibrissa.video.foreign.keypoints import LIKELIHOOD, Software, profile_from_keypoints, read_keypoints
from vibrissa.video.foreign.knutsen import read_knutsen
from vibrissa.video.foreign.segment_tables import read_segments
from vibrissa.video.foreign.whisk_files import Segment, measurements_beside, read_measurements, read_whiskers
from vibrissa.video.foreign.whisk_profile import Identity, KnownSegment, Side, known_of, profile_from_whisk
from vibrissa.video.foreign.whiskiwrap import read_whiskiwrap
from vibrissa.video.io.about import MOVIES
from vibrissa.video.link.thorough_linking import link_thoroughly
from vibrissa.video.linked.linked_profile import profile_from_linking
from vibrissa.video.tracking import Calibration

if TYPE_CHECKING:
    import xarray as xr

Curves = tuple[list[Segment], dict[tuple[int, int], KnownSegment] | None]

HDF5 = b"\x89HDF\r\n\x1a\n"
# by which the kind of an HDF5 file is known
TABLES = {"summary": "WhiskiWrap", "df_with_missing": "DeepLabCut", "tracks": "SLEAP", "pred_points": "SLEAP"}
OPENINGS = {  # by which that of other files is
    **dict.fromkeys(whisk_files.OPENINGS, "WHISK"),
    b"MATLAB": "WhiskerTracker",
    b"scorer": "DeepLabCut",
}
KNOWN = (
    "known are .whiskers of WHISK, HDF5 of WhiskiWrap, .csv and .h5 of DeepLabCut, .slp and analysis .h5 of SLEAP, "
    "and .mat of Knutsen's WhiskerTracker"
)


def kind_of(path: str | Path) -> str:
    """Which program wrote a file, by its content.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    str
        "WHISK", "WhiskiWrap", "DeepLabCut", "SLEAP" or "WhiskerTracker".

    Raises
    ------
    InputError
        If the file is missing or none of these.
    """
    with existing(path).open("rb") as stream:
        head = stream.read(128).removeprefix(BOM_UTF8)
    if head.startswith(HDF5):
        return _kind_of_tables(path)
    if head.startswith(b"measv"):
        raise FormatError(str(path), "must hold curves, not measurements", remedy="give the .whiskers file beside it")
    if Path(path).suffix.lower() in MOVIES | {".npy"}:
        raise FormatError(
            str(path), "must be a file of tracked whiskers", "a movie", f"vibrissa track {path} tracks it"
        )
    for opening, kind in OPENINGS.items():
        if head.startswith(opening):
            return kind
    raise FormatError(str(path), "must be a file of tracked whiskers", repr(head[:12]), KNOWN)


def _kind_of_tables(path: str | Path) -> str:
    import h5py

    try:
        with h5py.File(path, "r") as file:
            names = set(file)
    except (OSError, RuntimeError, ValueError, KeyError) as error:
        raise FormatError(str(path), "must be a whole HDF5 file", remedy=str(error)) from error
    kinds = [kind for name, kind in TABLES.items() if name in names]
    if not kinds:
        raise FormatError(str(path), "must be a file of tracked whiskers", f"HDF5 with {sorted(names)}", KNOWN)
    return kinds[0]


def read_tracks(
    path: str | Path,
    calibration: Calibration | None = None,
    *,
    measurements: str | Path | None = None,
    identity: Identity | Literal["link"] | None = None,
    whiskers: Sequence[int] | None = None,
    skin: Sequence[tuple[float, float]] | None = None,
    base: Side | None = None,
    keypoints: Sequence[Sequence[str]] | None = None,
    least_likelihood: float | None = None,
    node_spacing: float | None = None,
) -> xr.Dataset:
    """Profile of the whiskers in another program's file.

    Parameters
    ----------
    path : path
        A file as :func:`kind_of` knows them.
    calibration : Calibration, optional
        Frame rate and pixel size; only files of WhiskerTracker may do without.
    measurements : path, optional
        WHISK's ``.measurements``; default: that of the same name beside the file, if it is there.
    identity, whiskers, skin, base
        Of WHISK and WhiskiWrap, see :func:`vibrissa.video.foreign.whisk_profile.profile_from_whisk`; ``identity`` is
        "measured" if not given. With "link", lines are linked to whiskers by
        :func:`vibrissa.video.link.thorough_linking.link_thoroughly`, which finds the base ends too: then measurements,
        whiskers and base must not be given.
    keypoints : sequence of sequences of str, optional
        Of the others, see :func:`vibrissa.video.foreign.keypoints.profile_from_keypoints`.
    least_likelihood : float, optional
        Likewise; 0.6 of DeepLabCut, 0 of SLEAP if not given.
    node_spacing : float, optional
        Arc length between nodes [m]; default 5 pixels along curves, and the keypoints where there are such.

    Returns
    -------
    Dataset
        ``profile``: ``x``, ``y`` (whisker, time, node) and ``arc_length`` (whisker, node) [m], frame ``image``; NaN
        where a whisker is not in the file. There is no ``y_sd``: no such file has it. Attributes ``source`` (name
        of the file), ``format``, ``arc_length_from`` and ``lost`` as of :func:`vibrissa.video.tracking.track`.

    Raises
    ------
    InputError
        If the file is not whole or not known, a needed option is missing, or one is given that this kind of file has
        no use for.
    """
    kind = kind_of(path)
    curves = {"measurements": measurements, "identity": identity, "whiskers": whiskers, "skin": skin, "base": base}
    points = {"keypoints": keypoints, "least_likelihood": least_likelihood}
    for name, value in (points if kind in ("WHISK", "WhiskiWrap") else curves).items():
        if value is not None:
            raise ConflictError(name, f"must not be given: {path} is a file of {kind}, which has no use for it")
    if kind == "WhiskiWrap" and measurements is not None:
        raise ConflictError("measurements", f"must not be given: {path} is a file of {kind}, which holds them")
    noted = {"source": Path(path).name, "format": kind}
    if identity == "link":
        for name in ("measurements", "whiskers", "base"):
            if curves[name] is not None:
                raise ConflictError(name, "must not be given where lines are linked", remedy="leave it out")
        calibration = _needed(path, calibration)
        _, linking = link_thoroughly(read_segments(path, kind))
        return profile_from_linking(
            linking, calibration, source=str(path), node_spacing=node_spacing, skin=skin, attrs=dict(noted)
        )
    if kind in ("WHISK", "WhiskiWrap"):
        found: Curves = read_whiskiwrap(path) if kind == "WhiskiWrap" else _whisk(Path(path), measurements)
        return profile_from_whisk(
            *found,
            calibration=_needed(path, calibration),
            identity=identity or "measured",
            whiskers=whiskers,
            node_spacing=node_spacing,
            skin=skin,
            base=base,
            source=str(path),
            attrs=noted,
        )
    return _keypoint_profile(path, kind, calibration, keypoints, least_likelihood, node_spacing, noted)


def _needed(path: str | Path, calibration: Calibration | None) -> Calibration:
    if calibration is None:
        rule = f"must be given: {path} states neither frame rate nor scale"
        raise MissingError("frame_rate, pixel_size", rule, remedy="those of the camera")
    return calibration


def _whisk(path: Path, measurements: str | Path | None) -> Curves:
    """Segments, and what the measurements know of them (None: there are none)."""
    segments = read_whiskers(path)
    known = measurements_beside(path) if measurements is None else measurements
    return segments, None if known is None else known_of(read_measurements(known))


def _keypoint_profile(
    path: str | Path,
    kind: str,
    calibration: Calibration | None,
    keypoints: Sequence[Sequence[str]] | None,
    least_likelihood: float | None,
    node_spacing: float | None,
    noted: dict[str, str],
) -> xr.Dataset:
    if kind == "WhiskerTracker":
        points, own = read_knutsen(path)
        calibration = calibration or own
    else:
        calibration = _needed(path, calibration)  # before the reading, which is long
        points = read_keypoints(path, cast(Software, kind))
    return profile_from_keypoints(
        points,
        calibration=_needed(path, calibration),
        keypoints=keypoints,
        least_likelihood=LIKELIHOOD.get(kind, 0.0) if least_likelihood is None else least_likelihood,
        node_spacing=node_spacing,
        source=str(path),
        attrs=noted,
    )
