"""What commands print: JSON or tables on stdout, remarks on stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from cyclopts import Parameter, Token

from vibrissa.cli.shared.display.tables import table_lines
from vibrissa.errors import FormatError, MissingError

if TYPE_CHECKING:
    import xarray as xr

Words: TypeAlias = Sequence[str] | None
Json = Annotated[
    bool,
    Parameter(
        name="--json",
        negative="",
        help="Print one JSON object instead of a table: SI units, or adimensional as the names of `vibrissa` say; "
        'null is "not measured".',
    ),
]


def named(_: object, tokens: Sequence[Token]) -> Path:
    """The path of a file or folder to be written, which must have a name: "" would be the current folder.

    Parameters
    ----------
    tokens : sequence of Token
        The word of the command line.

    Returns
    -------
    Path
        As typed.

    Raises
    ------
    InputError
        If it has no name.
    """
    text = tokens[0].value
    if not (text and Path(text).absolute().name):
        raise FormatError(tokens[0].keyword or "--out", "must name a file or a folder", repr(text), "for example ./out")
    return Path(text)


Out = Annotated[Path, Parameter(converter=named)]
MaybeOut = Annotated[Path | None, Parameter(converter=named)]


@dataclass(frozen=True)
class Beside:
    """Files that are written beside the one that is named, for its annotation.

    Attributes
    ----------
    names : tuple of str
        Each with the path as ``{0.name}`` or ``{0.stem}``.
    """

    names: tuple[str, ...]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """Where the results go; a file that cannot be written is refused at once, before any work.

    Attributes
    ----------
    out : Path, optional
        Write the results as a dataset (NetCDF).
    json : bool
        Print one JSON object instead of a table.
    """

    out: MaybeOut = None
    json: Json = False

    def __post_init__(self) -> None:
        if self.out is not None:
            refuse_out(self.out)

    def save(self, data: xr.Dataset) -> None:
        """Write the dataset, if a file is named.

        Parameters
        ----------
        data : Dataset
            The results.
        """
        from vibrissa.netcdf import save

        if self.out is not None:
            save(data, self.out)

    def show(self, data: xr.Dataset, names: Words = None, *, columns: Words = None) -> None:
        """Write the dataset if a file is named, then print it as JSON or as a table.

        Parameters
        ----------
        data : Dataset
            The results.
        names : sequence of str, optional
            Variables to print; all by default.
        columns : sequence of str, optional
            Those of the table, where it has fewer than the JSON.
        """
        self.save(data)
        show(data, names if self.json or columns is None else columns, self.json)


PRINTED = OutputOptions()


def show(data: xr.Dataset, names: Words = None, json: bool = False) -> None:
    """Print the named variables as JSON or as a table.

    Parameters
    ----------
    data : Dataset
        The results.
    names : sequence of str, optional
        Variables to print; all by default.
    json : bool
        As JSON, or as a table.
    """
    wanted = list(names) if names is not None else [str(name) for name in (*data.coords, *data.data_vars)]
    if json:
        print_json({name: data[name].values for name in wanted})
    else:
        say(table_lines(data, wanted))


def names_without(data: xr.Dataset, *dims: str) -> list[str]:
    """Names of the variables that have none of some dimensions.

    Parameters
    ----------
    data : Dataset
        With its variables.
    dims : str
        The dimensions; one that the dataset lacks is passed over. All of the dataset's by default.

    Returns
    -------
    list of str
        In their order.
    """
    return [str(name) for name in data.drop_dims(dims or list(data.dims), errors="ignore").data_vars]


def say(lines: Sequence[str]) -> None:
    """Print lines on stdout, before what follows on stderr.

    Parameters
    ----------
    lines : sequence of str
        Lines.
    """
    for line in lines:
        print(line)
    sys.stdout.flush()


def tell(*lines: str) -> None:
    """Print remarks on stderr; stdout is for data.

    Parameters
    ----------
    lines : str
        A remark each.
    """
    for line in lines:
        print(f"vibrissa: {line}", file=sys.stderr)


def refuse_out(out: Path, *, table: bool = False) -> None:
    """Refuse, before any work, a file of results that is not named as a dataset or cannot be written.

    Parameters
    ----------
    out : Path
        The file.
    table : bool
        Whether it may be a table (.csv) instead.

    Raises
    ------
    InputError
        If its name or its folder will not do.
    """
    if table and out.suffix not in (".nc", ".csv"):
        raise FormatError("--out", "must end in .nc, a NetCDF dataset, or .csv, a table", str(out))
    if not table and out.suffix != ".nc":
        raise FormatError("--out", "must end in .nc, a NetCDF dataset", str(out))
    if not out.absolute().parent.is_dir():
        raise MissingError("--out", "must lie in an existing folder", str(out), "make it, or choose another")
    if out.is_dir() or not os.access(out.absolute().parent, os.W_OK):
        raise MissingError("--out", "must name a file that can be written", str(out), "choose another")


def print_json(values: dict[str, Any]) -> None:
    """One JSON object; NaN becomes null, "not measured", and an infinite number the text "Infinity" or "-Infinity".

    Parameters
    ----------
    values : dict
        Numbers, texts, arrays, lists and dicts by name.
    """
    import json

    import numpy as np

    def plain(value: Any) -> Any:
        if isinstance(value, np.ndarray | np.generic):
            return plain(value.tolist())
        if isinstance(value, list):
            return [plain(one) for one in value]
        if isinstance(value, dict):
            return {name: plain(one) for name, one in value.items()}
        if not isinstance(value, float) or np.isfinite(value):
            return value
        return None if np.isnan(value) else ("Infinity" if value > 0 else "-Infinity")

    print(json.dumps(plain(values)))
