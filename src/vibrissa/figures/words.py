"""Numbers as captions print them."""

from __future__ import annotations

import numpy as np

_LEAST = 1e-6  # of the value: below it an error is one of rounding


def decimals(error: float) -> int:
    """Decimals that give an error two digits.

    Parameters
    ----------
    error : float
        Above 0.

    Returns
    -------
    int
        0 from 10 on.
    """
    return max(0, 1 - int(np.floor(np.log10(float(f"{error:.1e}")))))


def with_error(value: float, error: float) -> str:
    """Value and its standard error, which has two digits; the value has no digit beyond them.

    Parameters
    ----------
    value : float
        NaN where it was not measured.
    error : float
        NaN where it is not known, or of rounding alone: then the value has three digits.

    Returns
    -------
    str
        ``0.2902 ± 0.0011``.
    """
    if not np.isfinite(value):
        return "not determined"
    if not error > _LEAST * abs(value):
        return f"{value:.3g}".replace("-", "−")
    digits = decimals(error)
    return f"{value:.{digits}f} ± {error:.{digits}f}".replace("-", "−")


def with_interval(value: float, low: float, high: float) -> str:
    """Value and its 95 % interval, of which the half width has two digits.

    Parameters
    ----------
    value, low, high : float
        NaN where not determined.

    Returns
    -------
    str
        ``3.751 [3.41, 4.12]``.
    """
    if not np.isfinite(value):
        return "not determined"
    half = (high - low) / 2
    if not half > _LEAST * abs(value):
        return f"{value:.3g}".replace("-", "−")
    digits = decimals(half)
    return f"{value:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]".replace("-", "−")
