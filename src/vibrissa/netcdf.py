"""NetCDF: equal bytes for equal datasets, a checksum at the end, and no dataset that breaks its schema."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from datetime import date, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibrissa.errors import FormatError, InputError
from vibrissa.files import existing, written_whole
from vibrissa.limits import require_memory
from vibrissa.quantities.schema import conforming
from vibrissa.reader_process import refuse_endless

if TYPE_CHECKING:
    import h5py
    import numpy as np
    import xarray as xr

_PACKED = {"zlib": True, "complevel": 4, "shuffle": True}  # level 9 takes three times as long for 1 % less
_SCALE, _NO_VARIABLE = b"DIMENSION_SCALE", b"This is a netCDF dimension but not a netCDF variable"
_LARGE = 1 << 14  # bytes: of less, the index of the chunks costs what is won
_SEAL = b"\nvibrissa: SHA-256 of all before this line: "  # behind the HDF5 file, which readers of HDF5 leave alone
_SEALED = len(_SEAL) + 64 + 1  # bytes, with the digest and a line's end


def save(data: xr.Dataset, path: str | Path) -> None:
    """Write a dataset as NetCDF (netCDF-4 through h5netcdf), whole or not at all.

    The file is built in memory first: the HDF5 library crashes where a disk fills up under it.

    Parameters
    ----------
    data : Dataset
        What is written.
    path : path
        Name of the file, which ends in ``.nc``; one that is there is replaced.

    Raises
    ------
    InputError
        If it is no dataset, holds dates or durations, an attribute of it is true or false, the name ends otherwise,
        and as ``written_whole``.
    """
    if not hasattr(data, "data_vars"):
        remedy = "give what its method sample returns: `.sample(rate=…)`" if hasattr(data, "sample") else ""
        remedy = "one with it: data.to_dataset(name=…)" if hasattr(data, "to_dataset") else remedy
        raise FormatError("data", "must be a Dataset", f"a {type(data).__name__}", remedy)
    if Path(path).suffix != ".nc":
        raise FormatError(str(path), "must end in .nc: a dataset is written as NetCDF")
    content = encoded(data)
    with written_whole(path) as temporary:
        temporary.write_bytes(content)


def encoded(data: xr.Dataset) -> bytes:
    """NetCDF of a dataset, equal bytes for equal datasets; large arrays of floats are compressed, without loss.

    Its last line is a checksum of all before it, which :func:`load` verifies and other programs drop as they write.

    It is built in another thread. A profiler, as the one in every worker of Dask, keeps what it sees in a thread
    alive for a moment; HDF5 then gives up the room of what it has deleted later, and lays the file out in another way.

    Parameters
    ----------
    data : Dataset
        What is encoded.

    Returns
    -------
    bytes
        Content of a NetCDF file.
    """
    _refuse_untyped(data)
    plain = data.drop_encoding()  # of a file that it was read from
    large = {name: _PACKED for name, one in plain.variables.items() if one.dtype.kind == "f" and one.nbytes >= _LARGE}
    with ThreadPoolExecutor(1) as unseen:
        content = bytes(unseen.submit(plain.to_netcdf, engine="h5netcdf", encoding=large).result())
    return content + _SEAL + hashlib.sha256(content).hexdigest().encode() + b"\n"


def _refuse_untyped(data: xr.Dataset) -> None:
    """Refuse what NetCDF has no type for: dates and durations, which come back as bare numbers, and true attributes."""
    import numpy as np

    parts: dict[Any, Any] = {"dataset": data, **data.variables}
    for name, one in parts.items():
        for attribute, value in one.attrs.items():
            kind = np.asarray(value).dtype.kind
            if kind == "b" or _of_time(np.asarray(value)):
                rule = f"must be text or numbers: NetCDF has no {'true and false' if kind == 'b' else 'dates'}"
                remedy = "int(…) or str(…)" if kind == "b" else "str(…)"
                raise FormatError(f"attribute {attribute!r} of {name}", rule, value, remedy)
    for name, one in data.variables.items():
        if _of_time(one):
            this, seconds = f"data[{name!r}]", "np.timedelta64(1, 's')"
            since = f"{this}.astype(str), or seconds since a date: ({this} - np.datetime64('2000-01-01')) / {seconds}"
            remedy = f"{this} / {seconds}" if one.dtype.kind == "m" else since
            raise FormatError(f"variable {name!r}", "must hold numbers or text: NetCDF has no dates", one.dtype, remedy)


def _of_time(values: np.ndarray | xr.Variable) -> bool:
    """Whether values are dates or durations, also as objects, of other calendars too."""
    if values.dtype.kind != "O":
        return values.dtype.kind in "mM"
    array: Any = getattr(values, "values", values)
    return any(isinstance(one, date | timedelta) or hasattr(one, "calendar") for one in array.flat)


def load(path: str | Path) -> xr.Dataset:
    """Read a dataset into memory; its dimensions in the order of the table of quantities.

    Parameters
    ----------
    path : path
        The file: written by :func:`save`, or by another program that follows the same names.

    Returns
    -------
    Dataset
        All of the file.

    Raises
    ------
    InputError
        If the file is missing, is no NetCDF file, was damaged, needs more memory than there is, or breaks the schema of
        one of its variables (see :func:`vibrissa.quantities.schema.conforming`).
    """
    import xarray as xr
    from xarray.backends import InMemoryDataStore

    path = existing(path)
    with reading(path):
        stored = _stored(path)
        if stored is None:
            data = xr.load_dataset(path, engine="h5netcdf", decode_times=False)
        else:
            data = xr.load_dataset(InMemoryDataStore(*stored), decode_times=False)  # type: ignore[no-untyped-call]
        return conforming(data)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Refuse a damaged file, with its name and the fault; what reads it does so within.

    Parameters
    ----------
    path : path
        A file that exists.

    Returns
    -------
    iterator of None
        Once.

    Raises
    ------
    InputError
        If it was damaged, or the library cannot read it.
    """
    if not _verified(path):
        refuse_endless(path)
    try:
        yield
    except InputError as error:
        raise error.renamed(f"{path}: {error.quantity}") from error
    except (OSError, ValueError, KeyError, TypeError, RuntimeError, AttributeError, OverflowError) as error:  # HDF5's
        rule, why = "must be a NetCDF file written by vibrissa", " ".join(str(error).split())
        raise FormatError(str(path), rule, remedy=why) from error


def _verified(path: Path) -> bool:
    """Refuse a file that is not what its last line sums up; files of other programs have no such line: False."""
    left = path.stat().st_size - _SEALED
    with open(path, "rb") as file:
        file.seek(max(left, 0))
        seal = file.read()
        if not seal.startswith(_SEAL):
            return False
        file.seek(0)
        found = hashlib.sha256()
        while left > 0 and (part := file.read(min(left, 1 << 20))):
            found.update(part)
            left -= len(part)
    if seal[len(_SEAL) :].strip() != found.hexdigest().encode():
        remedy = "take a copy of it, or remove it and compute it again"
        raise FormatError(str(path), "must be as it was written: its checksum does not hold", remedy=remedy)
    return True


def _fits(path: Path, arrays: list[h5py.Dataset]) -> None:
    """Refuse arrays that need more memory than there is, whatever few bytes they take in the file."""
    need = sum(one.size * max(one.dtype.itemsize, 8) for one in arrays)
    require_memory(str(path), f"{sum(one.size for one in arrays)} values", need)


def _stored(path: Path) -> tuple[dict[str, xr.Variable], dict[str, Any]] | None:
    """Variables and attributes, their conventions not decoded; None of a file that names dimensions in another way.

    h5netcdf looks for every dimension anew at each variable, which takes longer than all else.
    """
    import h5py
    import xarray as xr
    from h5netcdf.attrs import Attributes

    def attrs(of: h5py.HLObject) -> dict[str, Any]:
        return _texts(Attributes(of.attrs, h5py.check_dtype, h5py))

    with h5py.File(path, "r") as file:
        _fits(path, [one for one in file.values() if isinstance(one, h5py.Dataset)])
        scales = {one.attrs["_Netcdf4Dimid"]: name for name, one in file.items() if one.attrs.get("CLASS") == _SCALE}
        variables = {}
        for name, one in file.items():
            if one.attrs.get("NAME", b"").startswith(_NO_VARIABLE):
                continue
            if not isinstance(one, h5py.Dataset) or (one.ndim and "_Netcdf4Coordinates" not in one.attrs):
                return None
            dims = [scales[place] for place in one.attrs["_Netcdf4Coordinates"]] if one.ndim else []
            words = h5py.check_string_dtype(one.dtype) is not None
            values, encoding = (one.asstr()[()], {"dtype": str}) if words else (one[()], {})
            variables[name] = xr.Variable(dims, values, attrs(one), encoding)
        return variables, attrs(file)


def attributes(path: str | Path) -> dict[str, Any]:
    """Read the attributes alone of a dataset written by :func:`save`.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    dict
        Attributes by name.

    Raises
    ------
    InputError
        If the file is missing or is no NetCDF file.
    """
    import h5netcdf

    path = existing(path)
    with reading(path), h5netcdf.File(path, "r") as file:
        return _texts(file.attrs)


def _texts(attrs: Mapping[str, Any]) -> dict[str, Any]:
    """Attributes, those of one character too as text: the library of netCDF writes them as bytes."""
    filling = ("_FillValue", "missing_value")  # of the kind of their variable
    return {name: _text(one) if isinstance(one, bytes) and name not in filling else one for name, one in attrs.items()}


def _text(stored: bytes) -> str:
    """Text of bytes in UTF-8, or in the code of a single byte where they are none."""
    try:
        return stored.decode()
    except UnicodeDecodeError:
        return stored.decode("latin-1")
