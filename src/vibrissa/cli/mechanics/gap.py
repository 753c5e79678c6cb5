"""The verb `gap`: one gap that a whisker crosses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from vibrissa.cli.mechanics.rod_movie import MovieFile, refuse_movie, write_film
from vibrissa.cli.mechanics.rod_options import NO_ROD, RodOptions, ScanModel
from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, names_without, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import progress_bars, stage
from vibrissa.cli.shared.options import NO_WHISKER, PostureOptions, WhiskerOptions
from vibrissa.cli.shared.words.units import Length, OverLength, Speed, over_length
from vibrissa.errors import ConflictError
from vibrissa.whisker import DAMPING

if TYPE_CHECKING:
    from vibrissa.whisker import Whisker

_SPEED = 0.1  # [m/s] where none is given


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class MovingOptions:
    """How the gap moves; with --model free-end, auto or rod only.

    Attributes
    ----------
    speed : float, optional
        Speed of the texture past the base [m/s]; 0.1 by default.
    damping : float, optional
        Damping ratio of every mode, of the first three of a rod; 0.11 by default.
    """

    speed: Annotated[Speed | None, Parameter(name=("--speed", "--scan-speed"))] = None
    damping: float | None = None

    def refuse_with_modes(self) -> None:
        """Refuse them where modes predict: they take a gap that does not move.

        Raises
        ------
        InputError
            Names the first of them.
        """
        for option, value in (("--speed", self.speed), ("--damping", self.damping)):
            if value is not None:
                raise ConflictError(option, "must go with --model free-end or rod", value)


def gap(
    *,
    at: PostureOptions,
    gap_width: OverLength,
    gap_depth: Length = 35e-6,
    n_modes: int = 3,
    model: ScanModel = "modes",
    moving: MovingOptions = MovingOptions(),
    rod: RodOptions = NO_ROD,
    movie: MovieFile = None,
    of: WhiskerOptions = NO_WHISKER,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Predict how a whisker crosses a gap: when the contact jumps, and how far the linear response is off (Eq. 11).

    Lengths are over the length L of the nontruncated cone. With a whisker, the first line says whether the free end
    beyond the contact allows the jump. The other models draw the gap past the whole whisker instead: how far its modes
    move; with --model rod also what the follicle feels, and where it touches the ground.

    Parameters
    ----------
    gap_width
        Width of the gap, over L, or, with a whisker, as a length (0.6mm): 0.015 of a cone of 40 mm.
    gap_depth
        Depth of the gap [m]; it counts with a whisker only.
    n_modes
        Number of modes.
    """
    refuse_movie(movie, model)
    if model == "rod":
        return _rod(at, gap_width, gap_depth, n_modes, moving, rod, movie, of, drawing, output)
    rod.refuse_without_rod()
    if model != "modes":
        return _free_end(at, gap_width, gap_depth, n_modes, moving, of, drawing, output)
    moving.refuse_with_modes()
    from vibrissa.mechanics.scan.free_end import free_end_lines, unknown_free_end
    from vibrissa.mechanics.scan.gap_report import crossing

    cone = of.cone()
    posture, width = at.posture(cone), over_length(gap_width, "--gap-width", cone)
    with stage("gap"):
        data = crossing(posture, width, n_modes=n_modes, whisker=cone, depth=gap_depth)
    tell(data.attrs["verdict"])
    tell(*(unknown_free_end(posture.contact, width) if cone is None else free_end_lines(data)))
    tell("printed are jumps; how far a mode moves: --model rod or free-end")
    drawing.draw("others.contents", data)
    output.show(data, names_without(data, "s"))


def _free_end(
    at: PostureOptions,
    gap_width: OverLength,
    gap_depth: float,
    n_modes: int,
    moving: MovingOptions,
    of: WhiskerOptions,
    drawing: PictureOptions,
    output: OutputOptions,
) -> None:
    """The gap past a whisker with a free end, by the fast model."""
    from vibrissa.mechanics.free_end.free_end_gap import free_end_gap

    cone = of.needed_cone()
    with stage("gap"):
        data = free_end_gap(cone, at.posture(cone), **_drawn(gap_width, gap_depth, n_modes, moving, cone))
    tell(data.attrs["verdict"])
    drawing.draw("others.contents", data)
    output.show(data, names_without(data, "time"))


def _drawn(
    gap_width: OverLength, gap_depth: float, n_modes: int, moving: MovingOptions, cone: Whisker
) -> dict[str, Any]:
    """The gap as the models take it that draw it past the whisker."""
    return {
        "width": over_length(gap_width, "--gap-width", cone) * cone.length,
        "depth": gap_depth,
        "speed": _SPEED if moving.speed is None else moving.speed,
        "damping": DAMPING if moving.damping is None else moving.damping,
        "n_modes": n_modes,
    }


def _rod(
    at: PostureOptions,
    gap_width: OverLength,
    gap_depth: float,
    n_modes: int,
    moving: MovingOptions,
    rod: RodOptions,
    movie: Path | None,
    of: WhiskerOptions,
    drawing: PictureOptions,
    output: OutputOptions,
) -> None:
    """The gap under the whole whisker."""
    from vibrissa.mechanics.rod.rod_gap import gap_prediction, rod_gap
    from vibrissa.mechanics.scan.scan_span import GAP_RATE

    cone = of.needed_cone()
    crossing = gap_prediction(
        cone,
        at.posture(cone),
        **_drawn(gap_width, gap_depth, n_modes, moving, cone),
        settings=rod.settings(of),
    )
    with progress_bars() as progress:
        data = rod_gap(crossing, progress=lambda done, of_all: progress("the whole whisker", done, of_all))
    tell(data.attrs["verdict"])
    write_film(movie, lambda: crossing.film(GAP_RATE))
    drawing.draw("others.contents", data)
    output.show(data, names_without(data, "time"))
