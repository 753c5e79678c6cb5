"""Whole studies, their results, and sample data."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from vibrissa.api.shared.arguments import names_arguments
from vibrissa.api.shared.progress import notebook_bar
from vibrissa.errors import MissingError, did_you_mean
from vibrissa.netcdf import load, save

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Results", "load", "open_results", "run", "save"]


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
        Engine for repeated work: ``processes``, ``threads``, ``synchronous``, or the address of a Dask scheduler.
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
