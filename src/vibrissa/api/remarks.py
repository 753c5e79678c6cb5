"""Remarks of the public functions: what a reader of a result should know, as warnings of a class of their own."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


class Remark(UserWarning):
    """A sentence on an input or a result; ``warnings.simplefilter("ignore", Remark)`` silences all."""


def remark(*lines: str) -> None:
    """Issue each line as a warning at the caller of the public function.

    Parameters
    ----------
    lines : str
        A sentence each.
    """
    for line in lines:
        warnings.warn(as_sentence(line), Remark, stacklevel=4)


def remark_left_out(found: xr.Dataset) -> None:
    """Issue a warning where some results could not be had, with the reason.

    Parameters
    ----------
    found : Dataset
        Its attribute ``left_out`` names them.
    """
    if "left_out" in found.attrs:
        warnings.warn(as_sentence(f"some results are left out: {found.attrs['left_out']}"), Remark, stacklevel=4)


def as_sentence(line: str) -> str:
    """A line as the screen shows it, with capital and full stop, or the question mark that it has.

    Parameters
    ----------
    line : str
        ``the contact never jumps``.

    Returns
    -------
    str
        ``The contact never jumps.``
    """
    end = "" if line.endswith("?") else "."
    return f"{line[:1].upper()}{line[1:].rstrip('.')}{end}"
