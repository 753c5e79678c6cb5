"""Arrays in files of NumPy, sounds and archives: whole, without objects that would be run, no larger than memory."""

from __future__ import annotations

import struct
import warnings
import zipfile
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import FormatError
from vibrissa.files import existing
from vibrissa.limits import require_memory

_OF_DAMAGE = (
    struct.error,
    NameError,
    TypeError,
    ArithmeticError,
    LookupError,
    MemoryError,
)  # SciPy's, at damaged chunks
_LONGER = "copy a damaged file again; of several arrays save each in a file of its own"
COPIES = 4  # of an array's content, as a reader unpacks, converts and masks it


def read_npy(path: str | Path) -> NDArray[Any]:
    """Array of a file of NumPy, mapped into memory: only the parts that are used are read.

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
        If the file is absent, not as long as its header says, or holds Python objects, which would have to be run.
    """
    path = existing(path)
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except (ValueError, EOFError, OSError, SyntaxError, TokenError, TypeError, OverflowError, UnicodeError) as error:
        why = " ".join(str(error).split())[:80]
        raise FormatError(str(path), f"must be a whole array of NumPy, without Python objects ({why})") from error
    if not isinstance(array, np.memmap):
        array.close()
        raise FormatError(str(path), "must be one array of NumPy", "an archive of several")
    if more := path.stat().st_size - array.offset - array.nbytes:
        raise FormatError(str(path), "must end with the array that its header states", f"{more} bytes more", _LONGER)
    return array


_UNKNOWN = 0x7FFFF000  # bytes, or more, are what a recorder states that cannot go back to its header, as in a pipe


def read_wav(path: str | Path) -> tuple[int, NDArray[Any]]:
    """Sampling rate [Hz] and samples of a sound.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    rate : int
        As the file says.
    samples : (T, channels) array
        As the file says; 24 bits are in the upper ones of 32.

    Raises
    ------
    InputError
        If the file is absent, is no sound, is cut off, or needs more memory than there is.
    """
    from scipy.io import wavfile

    path = existing(path)
    require_memory(str(path), f"{path.stat().st_size / 1e9:.3g} GB", COPIES * path.stat().st_size)
    _refuse_cut_off(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)  # chunks of notes that recorders add
            rate, samples = wavfile.read(path)
    except (*_OF_DAMAGE, ValueError, OSError, EOFError) as error:
        why = "a part of it is missing" if isinstance(error, _OF_DAMAGE) else error
        raise FormatError(str(path), f"could not be read as .wav ({why})") from error
    return int(rate), samples[:, None] if samples.ndim == 1 else samples


def _refuse_cut_off(path: Path) -> None:
    """Refuse a sound that holds less than the header of its samples states; a damaged header is left to the reader."""
    with path.open("rb") as file:
        order, frame, long = ">" if file.read(12)[:4] == b"RIFX" else "<", 0, 0
        while len(head := file.read(8)) == 8:
            name, size = struct.unpack(f"{order}4sI", head)
            if name == b"data":
                break
            begin, body = file.tell(), file.read(16)
            if name == b"fmt " and len(body) == 16:
                frame = struct.unpack(f"{order}12xH2x", body)[0]
            if name == b"ds64" and len(body) == 16:
                long = struct.unpack("<8xQ", body)[0]  # of RF64, whose data states no length of its own
            file.seek(begin + size + size % 2)
        else:
            return
        present = path.stat().st_size - file.tell()
    size = long or size
    stated, found = (size // frame, present // frame) if frame else (0, 0)
    if stated > found and (long or size < _UNKNOWN):
        rule, lost = f"must hold the {stated} samples that its header states", f"{stated - found} samples are missing"
        raise FormatError(str(path), rule, str(found), f"{lost}: copy the file again, or record again")


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
