"""Binary messages: a header in JSON, then float32 arrays, little-endian, one after the other."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray


def packed(facts: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float32]]) -> bytes:
    """One message: length of the header (uint32), header, arrays; the header ends where four bytes align.

    The header holds the facts and, under ``arrays``, name and shape of each array in order.

    Parameters
    ----------
    facts : mapping
        What JSON can say.
    arrays : mapping of arrays
        By name.

    Returns
    -------
    bytes
        The message.
    """
    shapes = [[name, list(array.shape)] for name, array in arrays.items()]
    header = json.dumps({**facts, "arrays": shapes}, allow_nan=False).encode()
    header += b" " * (-len(header) % 4)
    parts = [np.uint32(len(header)).astype("<u4").tobytes(), header]
    return b"".join([*parts, *(np.ascontiguousarray(array, "<f4").tobytes() for array in arrays.values())])


def sketched(values: NDArray[np.float32], most: int) -> NDArray[np.float32]:
    """A signal (…, T) for a picture with fewer than ``most`` / 2 columns: of even stretches the least and the largest.

    The two keep their order in time; a signal of at most ``most`` samples is left as it is.

    Parameters
    ----------
    values : (…, T) array
        The signal.
    most : int
        Samples that are kept at most, about.

    Returns
    -------
    (…, T') array
        Of even stretches the least and the largest value.
    """
    length = -(-2 * values.shape[-1] // most)
    if values.shape[-1] <= most:
        return values
    behind = -values.shape[-1] % length
    whole = np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, behind)], mode="edge")
    stretches = whole.reshape(*values.shape[:-1], -1, length)
    first, second = np.sort([stretches.argmin(-1), stretches.argmax(-1)], axis=0)
    both = np.stack([first, second], axis=-1)
    return np.take_along_axis(stretches, both, axis=-1).reshape(*values.shape[:-1], -1)
