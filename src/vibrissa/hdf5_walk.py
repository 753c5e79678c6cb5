"""Walk through the whole structure of an HDF5 file, in a process, since the library runs for ever on some damage."""

from __future__ import annotations

import sys
from typing import Any


def walk(path: str) -> None:
    """Look at every group, attribute, text and index of chunks; numbers are not read.

    Parameters
    ----------
    path : str
        The file.
    """
    import h5py

    def look(_: str, thing: Any) -> None:
        dict(thing.attrs)
        if isinstance(thing, h5py.Dataset):
            if thing.dtype.kind == "O" and thing.size < _MANY:
                thing[()]
            elif thing.chunks:
                thing.id.get_num_chunks()

    with h5py.File(path, "r") as file:
        dict(file.attrs)
        file.visititems(look)


_MANY = 1_000_000  # texts and lists, beyond which they are left to their reader

if __name__ == "__main__":
    walk(sys.argv[1])
