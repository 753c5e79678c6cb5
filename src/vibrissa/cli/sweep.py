"""The verb of maps: `sweep`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from vibrissa.cli.options import Atlas, Json, OfWhisker, Scheduler, Workers, needed_cone
from vibrissa.cli.output import progress_bars, refuse_out, show, tell
from vibrissa.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.sweep import Gratings
    from vibrissa.texture.surface import Troughs

_MOST = 100_000  # numbers along one axis


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
    grating_length: float | None = None
    mean_period: float = 0.6e-3
    reading: Literal["telegraph", "widths"] = "telegraph"

    def texture(self, path: Path | None) -> Troughs | Gratings:
        """Gaps of the file, or the gratings."""
        from vibrissa.sweep import Gratings
        from vibrissa.texture.io import read_troughs

        if path is not None and self == GratingOptions():
            return read_troughs(path)
        if path is not None or self.seeds is None:
            remedy = "either --texture, or --seeds and --grating-length for random gratings"
            raise InputError("texture", "must be given once", remedy=remedy)
        if self.grating_length is None:
            raise InputError("--grating-length", "must be given with --seeds", remedy="for example 0.02 (metres)")
        return Gratings(
            seed=axis_of(self.seeds, "--seeds"),
            length=self.grating_length,
            reading=self.reading,
            mean_period=self.mean_period,
        )


OfMap = Annotated[Path | None, Parameter(help="Write the map: NetCDF (.nc), or a folder of Zarr (.zarr) if large.")]
OfGratings = Annotated[GratingOptions, Parameter(name="*")]


def sweep(
    *,
    texture: Path | None = None,
    drawn: OfGratings = GratingOptions(),
    contact: str,
    base_angle: str,
    scan_speed: str,
    friction: str = "0.4",
    quantity: Literal["peak", "rms"] = "peak",
    response: Literal["exact", "linear"] = "exact",
    jump: Literal["continuous", "ramp-limit", "paper2014"] = "continuous",
    damping: float = 0.11,
    least_linearity: float | None = None,
    count: int = 12,
    node: float = 0.9,
    scheduler: Scheduler = "threads",
    workers: Workers = None,
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    out: OfMap = None,
    json: Json = False,
) -> None:
    """Map of the vibration that textures excite, over contact, base angle, speed, friction and seeds of gratings.

    Numbers along an axis are written FIRST:LAST:HOW-MANY, or as a list with commas, in any order; the map has them
    ascending. Cells without a value, beyond the fold for one, are told with the reason.

    Parameters
    ----------
    texture
        CSV with columns position,width in metres, as `scan` takes it; one gap for the map of Figure 7E. Or --seeds.
    contact
        Positions of the contact along the shaft, over L: 0 at the cone's tip, 1 at the base.
    base_angle
        Angles of the shaft at the base to the substrate [rad], below π/2.
    scan_speed
        Speeds of the texture [m/s].
    friction
        Coefficients of friction of the substrate.
    quantity
        Largest displacement of one point of the shaft, or root mean square of mode 1; both over L.
    response
        Quasi-static response of the profile held by the edge, or the paper's linear one.
    jump
        What the velocity does where the contact jumps.
    damping
        Damping ratio of every mode.
    least_linearity
        Leave out cells in which the exact jump of mode 1 at the widest gap, over the linear one, is less.
    count
        Number of modes that the largest displacement sums.
    node
        Position s of the point whose largest displacement is taken, 1 at the base.
    """
    from vibrissa.sweep import Engine, Grid, Measure
    from vibrissa.sweep import sweep as computed
    from vibrissa.sweep.zarr_folder import refuse_zarr, save_zarr

    large = out if out is not None and out.suffix == ".zarr" else None
    if large is None:
        refuse_out(out)
    else:
        refuse_zarr(large)
    engine = Engine(scheduler=scheduler, workers=workers)
    cone, surface = needed_cone(whisker, atlas), drawn.texture(texture)
    grid = Grid(
        contact=axis_of(contact, "--contact"),
        base_angle=axis_of(base_angle, "--base-angle"),
        speed=axis_of(scan_speed, "--scan-speed"),
        friction=axis_of(friction, "--friction"),
    )
    measure = Measure(
        quantity=quantity,
        response=response,
        damping=damping,
        jump=jump,
        least_linearity=least_linearity,
        n_modes=count,
        node=node,
    )
    with progress_bars() as progress:
        data = computed(cone, surface, grid, measure, engine=engine, progress=progress)
    _tell_reasons(data)
    if out is None and not json:
        tell("the map itself is not printed: --out map.nc writes it, --json prints it")
    if large is not None:
        save_zarr(data, large)
        out = None
    show(data, None if json else [str(name) for name in data.data_vars if not data[name].dims], json, out)


def axis_of(text: str, option: str) -> list[float]:
    """Numbers of an axis, ascending."""
    return sorted(numbers_of(text, option))


def numbers_of(text: str, option: str) -> list[float]:
    """Numbers written FIRST:LAST:HOW-MANY, ends included, or as a list with commas."""
    import numpy as np

    try:
        if ":" not in text:
            return [float(word) for word in text.split(",")]
        first, last, count = text.split(":")
        if not 2 <= int(count) <= _MOST:
            raise InputError(option, f"must have 2 to {_MOST} numbers", repr(text))
        return np.linspace(float(first), float(last), int(count)).tolist()
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        rule = "must be FIRST:LAST:HOW-MANY or a list with commas"
        raise InputError(option, rule, repr(text), f"for example {option} 0.1:0.4:100 or {option} 0.1,0.2") from None


def _tell_reasons(data: xr.Dataset) -> None:
    """How many cells have no value, and why."""
    for code, reason in enumerate(data.cell_reason.attrs["flag_meanings"].split("; ")[1:], start=1):
        cells = int((data.cell_reason == code).sum())
        if cells:
            tell(f"{cells} of {data.cell_reason.size} postures without a value: {reason}")
