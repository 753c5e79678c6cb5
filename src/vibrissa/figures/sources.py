"""Where the data of a panel are from, as captions print it; names of whiskers and their marks, alike in all figures."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from itertools import cycle
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray as xr

MODEL = "one sweep of the one-contact model"
MOVIE = "one recorded movie"
_SWEEPS = {"rod": "sweeps of simulated rods", "modes": "sweeps of the one-contact model", "": "recorded sweeps"}
_LETTERS = {"alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ"}
_MARKS = {"beta": "o", "C1": "s", "C2": "^"}  # the paper's whiskers
_OTHER_MARKS = "vDPX<>"


def of_movie(study: Mapping[str, Any]) -> str:
    """What the movie of a study shows.

    Parameters
    ----------
    study : mapping
        With ``apparatus`` where the film is virtual.

    Returns
    -------
    str
        For a caption.
    """
    return MODEL if "apparatus" in study else MOVIE


def of_sweeps(sweeps: xr.Dataset | None) -> str:
    """What the sweeps of a table are of.

    Parameters
    ----------
    sweeps : Dataset or None
        The table; its attribute ``laboratory`` (JSON) says what a virtual laboratory simulated.

    Returns
    -------
    str
        For a caption.
    """
    laboratory = json.loads(sweeps.attrs.get("laboratory", "{}")) if sweeps is not None else {}
    return _SWEEPS[laboratory.get("truth", "rod") if laboratory else ""]


def printed_name(name: str) -> str:
    """Name of a whisker, perhaps with its animal, as figures print it.

    Parameters
    ----------
    name : str
        ``rat 1 beta``.

    Returns
    -------
    str
        ``rat 1 β``.
    """
    return re.sub(rf"\b({'|'.join(_LETTERS)})\b", lambda found: _LETTERS[found[0]], name)


def whisker_marks(names: Iterable[str]) -> dict[str, str]:
    """Mark of each whisker: β, C1 and C2 have their own in every figure, others take turns.

    Parameters
    ----------
    names : iterable of str
        Of the whiskers.

    Returns
    -------
    dict
        Name → mark of matplotlib.
    """
    others = sorted(set(names) - set(_MARKS))
    return _MARKS | dict(zip(others, cycle(_OTHER_MARKS)))
