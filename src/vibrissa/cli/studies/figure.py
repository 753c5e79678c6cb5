"""The verb `figure`: a figure of results."""

from __future__ import annotations

from pathlib import Path

from vibrissa.cli.shared.display.output import Out, tell
from vibrissa.cli.shared.display.pictures import refuse_picture, write_picture
from vibrissa.cli.shared.display.progress import stage
from vibrissa.errors import MissingError


def figure(number: str, results: Path, *, out: Out) -> None:
    """Draw one of the paper's figures, or of the report's others, from the results of any study; print its caption.

    Parameters
    ----------
    number
        1 to 9 as in the paper; 6ab and 7e for the model's panels; 10 for resonance and damping of every sweep; surface;
        base.
    results
        Folder that `run` or `recordings` wrote, or one dataset of it under its name there (gap.nc); of several
        recordings the table of units of one (units_2.nc), for figure 8 too; for figure 9 a table of units of any name.
    out
        Picture to write: .png, .pdf or .svg.
    """
    refuse_picture(out, "--out")
    if not results.exists():
        raise MissingError(str(results), "must be an existing folder or dataset")
    from vibrissa.figures.canvas import caption_of
    from vibrissa.study.report.gallery import figure_of

    with stage(f"figure {number}"):
        drawn = figure_of(number, results)
        write_picture(drawn, out)
    tell(caption_of(drawn), f"the figure is {out}")
