"""What is measured of whiskers in movies: angle, whisking cycle, curvature, touches."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.api.remarks import remark
from vibrissa.api.shared.arguments import names_arguments
from vibrissa.errors import ConflictError, RangeError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.measures.face import Point, Side

Line = tuple["Point", "Point"]

NEAR = 20.0  # distance from the middle of the tracks over their extent, beyond which a point is none of the image


@names_arguments
def kinematics(
    profile: xr.Dataset,
    *,
    face: Line | None = None,
    nose: Side | None = None,
    dorsal: Side | None = None,
    base_part: tuple[float, float] | None = None,
    whisking_band: tuple[float, float] = (4.0, 30.0),
    bridged: int = 0,
    pole: Point | None = None,
    pole_radius: float = 0.0,
    wall: Line | None = None,
    touch_distance: float | None = None,
    find_touches: bool = False,
    least_frames: int = 1,
    least_probability: float | None = None,
) -> xr.Dataset:
    """Angle, whisking cycle, curvature and touches of every whisker of a profile.

    Parameters
    ----------
    profile : Dataset
        Tracks, as ``track`` and ``read_tracks`` give them.
    face : ((x, y), (x, y)), optional
        A caudal and a rostral point of the line of the face, in the profile's frame [m].
    nose : {"left", "right", "top", "bottom"}, optional
        Side of the image to which the nose points; must be given without ``face``, which is then fitted to the bases
        of three whiskers or more, else an axis of the image.
    dorsal : {"left", "right", "top", "bottom"}, optional
        Side to which the back points, in a view from the side: whiskers are named by row and column if their bases fall
        into rows, else 1, 2, 3 … from caudal to rostral.
    base_part : (float, float), optional
        Arc lengths between which direction and curvature are measured [m]; by default a quarter of the
        length up to which the longest whisker is usually seen, and at least three nodes of each whisker.
    whisking_band : (float, float)
        Band of whisking [Hz].
    bridged : int
        Longest gap, in frames, bridged for the filter; what is bridged stays NaN.
    pole, pole_radius : (float, float), float
        Centre and radius of a pole [m].
    wall : ((x, y), (x, y)), optional
        Two points of a wall [m].
    touch_distance : float, optional
        Distance of the centreline to the object up to which it touches [m]; two pixels by default.
    find_touches : bool
        Find touches from the bending of the whisker, where no object is given.
    least_frames : int
        Frames below which a touch is left out; its frames are free then, also in ``touching``.
    least_probability : float, optional
        Probability of a name below which a whisker counts as not seen, from that of the tracking (the default) to 1.
        Face, base part and labels are those of all names.

    Returns
    -------
    Dataset
        On (whisker, time): ``whisker_angle`` to the face [rad] (0 caudal, π/2 across, π rostral), ``whisking_phase``
        [rad] (0 most protracted), ``whisking_amplitude`` and ``set_point`` [rad], ``whisking_frequency`` [Hz],
        ``whisker_curvature`` [1/m] (positive to the nose), ``curvature_change`` Δκ; with an object or ``find_touches``
        also ``object_distance`` [m] and ``touching``, and on (touch) ``touch_onset``, ``touch_offset``,
        ``touch_duration`` [s], ``touch_whisker``, ``touch_angle``, ``touch_phase``, ``touch_curvature_change``. NaN
        where the whisker was not seen.

    Raises
    ------
    InputError
        If neither face nor nose is given, or settings do not fit the profile.

    Examples
    --------
    >>> import vibrissa as vb
    >>> profile = vb.track(vb.sample_data("movie.mkv"), frame_rate=2000, pixel_size=95e-6)
    >>> found = vb.kinematics(profile, face=((0.0, 0.0), (0.0, 0.01)))
    >>> found.whisker_angle.dims
    ('whisker', 'time')
    """
    from vibrissa.measures.face import Face
    from vibrissa.measures.kinematics import KinematicsSettings, kinematics_of
    from vibrissa.measures.touched_object import Pole, Wall

    if pole is not None and wall is not None:
        raise ConflictError("wall", "must be left out where a pole is given", wall)
    _refuse_pixels(profile, face=() if face is None else face, pole=() if pole is None else (pole,), wall=wall or ())
    touched = None if pole is None else Pole(centre=pole, radius=pole_radius)
    settings = KinematicsSettings(
        face=None if face is None else Face(caudal=face[0], rostral=face[1]),
        nose=nose,
        dorsal=dorsal,
        base_part=base_part,
        whisking_band=whisking_band,
        bridged=bridged,
        touched=touched if wall is None else Wall(ends=wall),
        touch_distance=touch_distance,
        find_touches=find_touches,
        least_frames=least_frames,
        least_probability=least_probability,
    )
    found = kinematics_of(profile, settings)
    remark(*json.loads(found.attrs["remarks"]))
    return found


def _refuse_pixels(profile: xr.Dataset, **points: Sequence[Point]) -> None:
    """Refuse points so far from the tracks that they cannot be in metres."""
    middle = np.array([float(profile[axis].mean()) for axis in ("x", "y")])
    extent = max(float(profile[axis].max() - profile[axis].min()) for axis in ("x", "y"))
    for name, given in points.items():  # of a line the other point may be far away
        if given and min(np.abs(np.asarray(point) - middle).max() for point in given) > NEAR * extent:
            rule = f"must be in metres, near tracks of {extent:.3g} m"
            raise RangeError(name, rule, tuple(map(float, given[0])), "multiply pixels by the size of a pixel")
