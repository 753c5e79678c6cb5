"""Results of a folder, each read when it is wanted: a damaged one stops only what needs it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.netcdf import load

if TYPE_CHECKING:
    import xarray as xr


class StoredResults(Mapping[str, "xr.Dataset"]):
    """Results of a folder by name, each read when it is wanted.

    Parameters
    ----------
    folder : Path
        Of the results.
    end : str
        End of the names; results are known without it, and those without it are not known.
    """

    def __init__(self, folder: Path, end: str = "") -> None:
        self.paths = {path.stem.removesuffix(end): path for path in sorted(folder.glob(f"*{end}.nc"))}
        self.read: dict[str, xr.Dataset] = {}

    def __getitem__(self, name: str) -> xr.Dataset:
        """The result of this name."""
        if name not in self.read:
            self.read[name] = load(self.paths[name])
        return self.read[name]

    def __iter__(self) -> Iterator[str]:
        """Names, without reading."""
        return iter(self.paths)

    def __len__(self) -> int:
        """How many there are."""
        return len(self.paths)
