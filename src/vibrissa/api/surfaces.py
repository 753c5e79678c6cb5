"""Surfaces from files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from vibrissa.api.remarks import remark
from vibrissa.api.shared.arguments import names_arguments
from vibrissa.texture.io import Settled, read_texture

if TYPE_CHECKING:
    from vibrissa.texture.relief import HeightProfile
    from vibrissa.texture.surface import Gaps


@names_arguments
def read_surface(
    path: str | Path,
    *,
    line: str | None = None,
    part: tuple[float, float] | None = None,
    x_unit: str | None = None,
    z_unit: str | None = None,
    fill: bool = False,
    levelling: Literal["line", "none"] | None = None,
    reverse: bool = False,
) -> Gaps | HeightProfile:
    """A surface from a table or from the file of a profilometer or microscope.

    Parameters
    ----------
    path : path
        CSV of gaps (``position,width``) or of heights (``position_mm,height_um``), ``.npy``, or, with the extra
        ``surface``, a format that SurfaceTopography reads.
    line : str, optional
        Line of a map: ``"x:12"`` runs along x as number 12 along y, from 0; ``"y:12"`` along y.
    part : (float, float), optional
        Distances from the file's first point that are wanted [m].
    x_unit, z_unit : str, optional
        Units of positions and heights (m, mm, um, nm) where the file states none.
    fill : bool
        Straight lines across points that were not measured.
    levelling : {"line", "none"}, optional
        Subtract the tilt, or keep it.
    reverse : bool
        Scan in the other direction.

    Returns
    -------
    Gaps or HeightProfile
        Gaps, or heights along the scan. What was decided of the file is issued as a warning of the class
        :class:`vibrissa.api.remarks.Remark`.

    Raises
    ------
    InputError
        If the file leaves something open that is not given, or cannot be read.

    Examples
    --------
    >>> import vibrissa as vb
    >>> surface = vb.read_surface(vb.sample_data("grating.csv"))
    >>> surface.width.size > 100
    True
    """
    settled: Settled = {
        "line": line,
        "part": part,
        "fill": fill,
        "level": levelling,
        "x_unit": x_unit,
        "z_unit": z_unit,
    }
    return read_texture(path, flip=reverse, tell=remark, **settled)
