"""The verb `kinematics`: angle, whisking cycle, curvature and touches of tracked whiskers."""

from __future__ import annotations

import json as texts
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from cyclopts import Parameter

from vibrissa.cli.movies.points import Point, Side, line_of, points_of
from vibrissa.cli.shared.display.output import Json, MaybeOut, refuse_out, show, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.options import Flag
from vibrissa.cli.shared.words.refusals import in_options
from vibrissa.cli.shared.words.units import Length, Rate
from vibrissa.errors import ConflictError, FormatError, MissingError, TooFewError

if TYPE_CHECKING:
    from vibrissa.measures.touched_object import Touchable


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ObjectOptions:
    """The object that whiskers touch.

    Attributes
    ----------
    pole : str, optional
        COLUMN,ROW of the centre of a pole [pixels].
    pole_radius : float
        Radius of the pole [m].
    wall : list of str, optional
        COLUMN,ROW of a point of a wall [pixels]; twice.
    touch_distance : float, optional
        Largest distance of a touching centreline to the surface [m]; two pixels by default.
    find_touches : bool
        Find touches from the bending of each whisker, where no object is given.
    least_frames : int
        Least length of a touch, in frames; shorter ones are left out, and their frames are free.
    """

    pole: str | None = None
    pole_radius: Length = 0.0
    wall: list[str] | None = None
    touch_distance: Length | None = None
    find_touches: Flag = False
    least_frames: int = 1

    def touched(self, pixel_size: float) -> Touchable | None:
        """The pole or the wall, if one is given.

        Parameters
        ----------
        pixel_size : float
            Side of a pixel [m]; NaN where it is not known.

        Returns
        -------
        Pole or Wall or None
            In metres.
        """
        from vibrissa.measures.touched_object import Pole, Wall

        line = line_of(self.wall, "--wall")
        if self.pole is not None and line is not None:
            raise ConflictError("--wall", "must be left out where --pole is given")
        if self.pole is None and self.pole_radius:
            raise ConflictError("--pole-radius", "must go with --pole")
        if self.find_touches and (self.pole is not None or line is not None):
            raise ConflictError("--find-touches", "must be left out where the object is given")
        if line is not None:
            return Wall(ends=_in_metres(line, pixel_size, "--wall"))
        if self.pole is None:
            return None
        centre = points_of([self.pole], "--pole")[0]
        return Pole(centre=_in_metres((centre, centre), pixel_size, "--pole")[0], radius=self.pole_radius)


NO_OBJECT = ObjectOptions()
TRACKED = (".whiskers", ".hdf5", ".h5", ".csv", ".slp")  # files of other programs


def kinematics(
    profile: Path,
    *,
    face: list[str] | None = None,
    nose: Side | None = None,
    dorsal: Side | None = None,
    base_part: tuple[Length, Length] | None = None,
    whisking_band: tuple[Rate, Rate] = (4.0, 30.0),
    bridged: int = 0,
    least_probability: float | None = None,
    touched: ObjectOptions = NO_OBJECT,
    out: MaybeOut = None,
    drawing: PictureOptions = NO_PICTURE,
    json: Json = False,
) -> None:
    """Measure angle, whisking phase, amplitude, set point, frequency, curvature and touches of tracked whiskers.

    Print a line for each whisker; --out has every frame. NaN where the whisker was not seen.

    Parameters
    ----------
    profile
        Profile (.nc) from `track` or `import-tracks`.
    face
        COLUMN,ROW of a caudal, then of a rostral point of the line of the face [pixels]; twice.
    nose
        Side of the image to which the nose points; must be given without --face. The line is then fitted to the bases.
    dorsal
        Side of the image to which the back points, in a view from the side: whiskers are named by row and column.
    base_part
        START STOP of the arc length on which direction and curvature are measured [m]; the first quarter by default.
    whisking_band
        LOW HIGH of the band of whisking [Hz].
    bridged
        Longest gap of frames without the whisker that is bridged for the filter; bridged frames stay NaN.
    least_probability
        Probability of a name below which the whisker counts as not seen; by default that of the tracking.
    out
        File of every frame: a dataset (.nc), or a table (.csv) with NAME-touches.csv.
    """
    from vibrissa.measures.face import Face
    from vibrissa.measures.kinematics import KinematicsSettings, kinematics_of
    from vibrissa.measures.summary import per_whisker
    from vibrissa.measures.tidy_tables import write_kinematics
    from vibrissa.netcdf import load, save

    if out is not None:
        refuse_out(out, table=True)
    if profile.is_file() and profile.suffix != ".nc":
        reader = "import-tracks" if profile.suffix in TRACKED else "track"
        remedy = f"read it first: vibrissa {reader} {profile}"
        raise FormatError(str(profile), "must be a NetCDF file (.nc) of track or import-tracks", remedy=remedy)
    tracks, line = load(profile), line_of(face, "--face")
    if "x" not in tracks:
        remedy = "take what `vibrissa track --out` wrote, not its lines or measures"
        raise TooFewError(str(profile), "must hold profiles", remedy=remedy)
    size = float(tracks.attrs.get("pixel_size", np.nan))
    ends = None if line is None else _in_metres(line, size, "--face")
    settings = KinematicsSettings(
        face=None if ends is None else Face(caudal=ends[0], rostral=ends[1]),
        nose=nose,
        dorsal=dorsal,
        base_part=base_part,
        whisking_band=whisking_band,
        bridged=bridged,
        touched=touched.touched(size),
        touch_distance=touched.touch_distance,
        find_touches=touched.find_touches,
        least_frames=touched.least_frames,
        least_probability=least_probability,
    )
    data = kinematics_of(tracks, settings)
    drawing.draw("others.kinematics", data)
    if out is not None and out.suffix == ".csv":
        tell(f"written: {', '.join(map(str, write_kinematics(data, out)))}")
    elif out is not None:
        save(data, out)
    tell(*map(in_options, texts.loads(data.attrs["remarks"])))
    show(per_whisker(data), json=json)


def _in_metres(line: tuple[Point, Point], pixel_size: float, option: str) -> tuple[Point, Point]:
    """Two points of the image in metres."""
    if not np.isfinite(pixel_size):
        raise MissingError(option, "must be of a profile that states its pixel size", remedy="leave it out")
    (a, b), (c, d) = line
    return (a * pixel_size, b * pixel_size), (c * pixel_size, d * pixel_size)
