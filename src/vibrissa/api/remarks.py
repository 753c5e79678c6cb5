"""Remarks of the public functions: what a reader of a result should know, as warnings of a class of their own."""

from __future__ import annotations

import warnings


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
        warnings.warn(line, Remark, stacklevel=4)
