"""Arrays in files of NumPy, and archives: whole, without objects that would be run, no larger than memory."""

from __future__ import annotations

import zipfile
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import FormatError
from vibrissa.files import existing
from vibrissa.limits import require_memory

COPIES = 4  # of an array's content, as a reader unpacks, converts and masks it


def read_npy(path: str | Path) -> NDArray[Any]:
    """Array of a file of NumPy, mapped into memory: only what is used is read.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    array
        As the file says, not writable.

    Raises
    ------
    InputError
        If the file is absent, shorter than its header says, or holds Python objects, which would have to be run.
    """
    path = existing(path)
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except (ValueError, EOFError, OSError, SyntaxError, TokenError, TypeError, OverflowError, UnicodeError) as error:
        why = " ".join(str(error).split())[:80]
        raise FormatError(str(path), f"must be a whole array of NumPy, without Python objects ({why})") from error
    if not isinstance(array, np.ndarray):
        array.close()
        raise FormatError(str(path), "must be one array of NumPy", "an archive of several")
    return array


def refuse_bomb(path: str | Path) -> None:
    """Refuse an archive whose content needs more memory than there is; a file that is no archive passes.

    Parameters
    ----------
    path : path
        The file.

    Raises
    ------
    InputError
        With the size of its content.
    """
    if zipfile.is_zipfile(existing(path)):
        try:
            with zipfile.ZipFile(path) as archive:
                size = sum(one.file_size for one in archive.infolist())
        except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
            raise FormatError(str(path), f"must be a whole archive ({error})") from error
        require_memory(str(path), f"{size / 1e9:.3g} GB unpacked", COPIES * size)
