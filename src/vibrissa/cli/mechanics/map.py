"""The verb `map`: the vibration that textures excite, over postures and speeds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from vibrissa.cli.mechanics.rod_options import NO_ROD, RodOptions
from vibrissa.cli.shared.display.output import Json, MaybeOut, OutputOptions, names_without, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import progress_bars
from vibrissa.cli.shared.options import NO_WHISKER, Scheduler, WhiskerOptions, Workers
from vibrissa.cli.shared.words.axes import AngleAxis, Axis, NumberAxis, OverLengthAxis, SpeedAxis, axis_of, values_of
from vibrissa.cli.shared.words.units import Length, OverLength, over_length
from vibrissa.errors import ConflictError
from vibrissa.whisker import DAMPING

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.rod.rod_settings import Rod
    from vibrissa.sweep.gratings import Gratings
    from vibrissa.texture.surface import Gaps


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class GratingOptions:
    """Random gratings instead of a texture.

    Attributes
    ----------
    seeds : str, optional
        Instead of --texture: seeds of random square-wave gratings, one map for each. Equal seeds, equal gratings.
    grating_length : float, optional
        Length of each grating [m].
    mean_period : float
        Mean of one land and one gap of a grating together [m].
    reading : {"telegraph", "widths"}
        How a grating's widths are drawn: edges without memory, or Gaussian widths.
    """

    seeds: str | None = None
    grating_length: Length | None = None
    mean_period: Length = 0.6e-3
    reading: Literal["telegraph", "widths"] = "telegraph"

    def texture(self, path: Path | None) -> Gaps | Gratings:
        """Gaps of the file, or the gratings.

        Parameters
        ----------
        path : Path, optional
            The file.

        Returns
        -------
        Gaps or Gratings
            The texture.

        Raises
        ------
        InputError
            If both or neither are given.
        """
        from vibrissa.sweep.gratings import Gratings
        from vibrissa.texture.io import read_gaps

        if path is not None and self == GratingOptions():
            return read_gaps(path)
        if path is not None or self.seeds is None:
            remedy = "either --texture, or --seeds and --grating-length for random gratings"
            raise ConflictError("texture", "must be given once", remedy=remedy)
        if self.grating_length is None:
            raise ConflictError("--grating-length", "must be given with --seeds", remedy="for example 0.02 (metres)")
        return Gratings(
            seed=axis_of(self.seeds, "--seeds", "number").values,
            length=self.grating_length,
            reading=self.reading,
            mean_period=self.mean_period,
        )


OfMap = Annotated[MaybeOut, Parameter(help="Write the map: NetCDF (.nc), or a folder of Zarr (.zarr) if large.")]


def map_(
    *,
    texture: Path | None = None,
    drawn: GratingOptions = GratingOptions(),
    contact: OverLengthAxis,
    base_angle: AngleAxis,
    speed: SpeedAxis,
    friction: NumberAxis = Axis([0.4]),  # noqa: B008
    quantity: Literal["peak", "rms"] = "peak",
    response: Literal["exact", "linear"] = "exact",
    jump: Literal["continuous", "ramp-limit", "paper2014"] = "continuous",
    damping: float = DAMPING,
    least_linearity: float | None = None,
    n_modes: int = 12,
    point: OverLength = 0.9,
    model: Literal["modes", "rod"] = "modes",
    rod: RodOptions = NO_ROD,
    scheduler: Scheduler = "threads",
    workers: Workers = None,
    of: WhiskerOptions = NO_WHISKER,
    drawing: PictureOptions = NO_PICTURE,
    out: OfMap = None,
    json: Json = False,
) -> None:
    """Map the vibration that textures excite, over contact, base angle, speed, friction and seeds of gratings.

    Numbers along an axis are written FIRST:LAST:HOW-MANY (45deg:80deg:7), or as a list with commas, in any order; the
    map has them ascending. Cells without a value, beyond the fold for one, are counted by their reason.

    Parameters
    ----------
    texture
        CSV with columns position,width in metres, as `scan` takes it; one gap for the map of Figure 7E. Or --seeds.
    contact
        Positions of the contact along the shaft, over L: 0 at the cone's tip, 1 at the base; or distances from the tip
        of the cone along the shaft (8mm:16mm:5).
    base_angle
        Angles of the shaft at the base to the substrate [rad], below π/2.
    speed
        Speeds of the texture [m/s].
    friction
        Coefficients of friction of the substrate.
    quantity
        Largest displacement of one point of the shaft, or root mean square of mode 1 about its mean; both over L, and
        from the first gap to the end of the texture (`scan` also counts the ringing after it).
    response
        Quasi-static response of the profile held by the edge, or the paper's linear one.
    jump
        Change of the velocity where the contact jumps.
    damping
        Damping ratio of every mode.
    least_linearity
        Least exact jump of mode 1 at the widest gap over the linear one; cells with less are left out.
    n_modes
        Number of modes that the largest displacement sums.
    point
        Point of the shaft whose largest displacement is mapped: its position s, 1 at the base; or its distance from the
        tip of the cone along the shaft (36mm).
    model
        The paper's modes of a shaft with a single contact; or the whole whisker as a rod, run once for each cell, to
        which response, jump, n-modes and least-linearity do not apply.
    """
    from vibrissa.mechanics.statics.contact_law import friction_remarks
    from vibrissa.sweep.engine import Engine
    from vibrissa.sweep.grid import Grid, Measure
    from vibrissa.sweep.maps import sweep as computed
    from vibrissa.sweep.zarr_folder import refuse_zarr, save_zarr

    large = out if out is not None and out.suffix == ".zarr" else None
    if large is not None:
        refuse_zarr(large)
    output = OutputOptions(out=None if large else out, json=json)
    engine = Engine(scheduler=scheduler, workers=workers)
    cone, surface = of.needed_cone(), drawn.texture(texture)
    grid = Grid(
        contact=values_of(contact, "--contact", cone),
        base_angle=base_angle.values,
        speed=speed.values,
        friction=friction.values,
    )
    measure = Measure(
        quantity=quantity,
        response=response,
        damping=damping,
        jump=jump,
        least_linearity=least_linearity,
        n_modes=n_modes,
        node=over_length(point, "--point", cone),
        rod=_settings(model, rod, of),
    )
    with progress_bars() as progress:
        data = computed(cone, surface, grid, measure, engine=engine, progress=progress)
    tell(data.attrs["verdict"], *(line for one in friction.values for line in friction_remarks(one)))
    _remark_reasons(data)
    if out is None and not json:
        tell("the map itself is not printed: --out map.nc writes it, --json prints it")
    if large is not None:
        save_zarr(data, large)
    drawing.draw("others.contents", data)
    output.show(data, columns=names_without(data))


def _settings(model: str, rod: RodOptions, of: WhiskerOptions) -> Rod | None:
    if model == "rod":
        return rod.settings(of)
    rod.refuse_without_rod()
    return None


def _remark_reasons(data: xr.Dataset) -> None:
    """Report how many cells have no value, and why."""
    for code, reason in enumerate(data.cell_reason.attrs["flag_meanings"].split("; ")[1:], start=1):
        cells = int((data.cell_reason == code).sum())
        if cells:
            tell(f"{cells} of {data.cell_reason.size} postures without a value: {reason}")
