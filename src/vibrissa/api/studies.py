"""Whole studies, their results, and sample data."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from vibrissa.api.arguments import names_arguments
from vibrissa.api.progress import notebook_bar
from vibrissa.errors import MissingError, did_you_mean
from vibrissa.netcdf import load, save

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Results", "load", "open_results", "run", "sample_data", "save"]

DRAWN = {"movie.mkv": "a virtual movie, as the built-in experiment films it, of 400 frames"}


class Results(Mapping[str, "xr.Dataset"]):
    """Results of a study: its datasets by name, each read when it is asked for.

    Attributes
    ----------
    folder : Path
        Where they are.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.nc"

    def __getitem__(self, name: str) -> xr.Dataset:
        if name not in self:
            raise KeyError(f"{name!r}: {did_you_mean(name, list(self))}")
        return load(self._path(name))

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self._path(name).is_file()

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(path.stem for path in self.folder.glob("*.nc")))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __repr__(self) -> str:
        return f"<Results in {self.folder}: {', '.join(self)}>"

    @property
    def report(self) -> Path:
        """The report, a page to be opened in a browser."""
        return self.folder / "report.html"

    @property
    def provenance(self) -> dict[str, object]:
        """What each number was made of."""
        return dict(json.loads((self.folder / "provenance.json").read_text(encoding="utf-8")))


@names_arguments
def open_results(folder: str | Path) -> Results:
    """Open the folder of results that a study wrote.

    Parameters
    ----------
    folder : path
        Of :func:`run`, or ``vibrissa run --out``.

    Returns
    -------
    Results
        Datasets by name.

    Raises
    ------
    InputError
        If there are none in it.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import vibrissa as vb
    >>> with TemporaryDirectory() as folder:
    ...     vb.save(vb.modes(vb.atlas("C2")), f"{folder}/modes.nc")
    ...     list(vb.open_results(folder))
    ['modes']
    """
    if not any(Path(folder).glob("*.nc")):
        raise MissingError(str(folder), "must be a folder of results", remedy="give the folder that a run wrote")
    return Results(folder)


@names_arguments
def run(
    study: str | Path | None = None,
    out: str | Path = "vibrissa-out",
    *,
    scale: Literal["small", "paper"] = "small",
    scheduler: str = "processes",
    workers: int | None = None,
) -> Results:
    """Run a study, or the built-in virtual experiment; a run that was stopped is continued.

    Parameters
    ----------
    study : path, optional
        Study file (TOML).
    out : path
        Folder of the results; made if absent.
    scale : {"small", "paper"}
        Of the built-in experiment.
    scheduler : str
        What computes repeated work: ``processes``, ``threads``, ``synchronous``, or the address of a Dask scheduler.
    workers : int, optional
        Processes or threads; one for each core by default.

    Returns
    -------
    Results
        Datasets by name, and the report.

    Raises
    ------
    InputError
        If an input is bad, or the folder holds another study's results.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import vibrissa as vb
    >>> with TemporaryDirectory() as folder:
    ...     results = vb.run(vb.sample_data("surface-file.toml"), folder)
    ...     list(results)
    ['gain_map', 'gap', 'gaps', 'scan']
    """
    from vibrissa.study.run.study import run_study
    from vibrissa.study.spec.settings import read_study
    from vibrissa.sweep.engine import Engine

    with notebook_bar() as progress:
        run_study(read_study(study, scale), out, engine=Engine(scheduler=scheduler, workers=workers), progress=progress)
    return Results(out)


@names_arguments
def sample_data(name: str) -> Path:
    """Path of a small file to try things on.

    Parameters
    ----------
    name : str
        A file of the project's examples (``grating.csv``, ``ridges.csv``, ``diameters.csv``, ``spikes.csv``, …), or
        ``movie.mkv``, a virtual movie of 400 frames that is rendered when it is first asked for: a whisker of 40 mm and
        1.5 mrad, contact 0.29, base angle 1.2 rad, 2000 frames/s, pixels of 95 µm, over ``random_grating(0.35, rng=1)``
        at 0.1 m/s with damping 0.11 and the linear response.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If there is none of that name; the nearest is suggested.

    Examples
    --------
    >>> import vibrissa as vb
    >>> vb.sample_data("grating.csv").name
    'grating.csv'
    """
    shipped = {path.name: path for path in sorted(_examples().iterdir()) if path.suffix in (".csv", ".toml")}
    if name in shipped:
        return shipped[name]
    if name in DRAWN:
        return _virtual_movie()
    raise MissingError("name", "must be a sample", repr(name), did_you_mean(name, [*shipped, *DRAWN]))


def _examples() -> Path:
    """Folder of the examples: in the installed package, or in a clone."""
    packaged = Path(__file__).parents[1] / "data" / "examples"
    return packaged if packaged.is_dir() else Path(__file__).parents[3] / "examples"


def _virtual_movie() -> Path:
    """The movie, rendered once for each user."""
    from dataclasses import replace

    from vibrissa import __version__
    from vibrissa.files import written_whole
    from vibrissa.study.movie.virtual import film_motion, lay_out, predicted_motion
    from vibrissa.study.spec.settings import read_study
    from vibrissa.video.io.movie import write_movie

    path = Path(tempfile.gettempdir()) / f"vibrissa-{__version__}-movie.mkv"
    if not path.is_file():
        study = read_study(None, "small")
        assert study.film is not None
        film, motion = replace(study.film, n_frames=400), predicted_motion(study)
        with written_whole(path) as temporary:
            write_movie(temporary, film_motion(motion, film, lay_out(motion, film)), playback_rate=25)
    return path
