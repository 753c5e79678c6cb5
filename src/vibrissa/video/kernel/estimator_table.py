"""Estimators that place a line in a column: their names and what each does, for the kernel, commands, studies and docs.

The profile that is matched is Vibrissa's own, the barycentre that of [Boubenec2014]_, the Gaussian through three pixels
that of [FisherNaidu1996]_. To add one, name it here and give its kernel a branch in
:func:`vibrissa.video.kernel.estimators.place`.
"""

from __future__ import annotations

from typing import Literal, get_args

Estimator = Literal["matched", "barycentre", "three-point"]

ESTIMATORS: dict[Estimator, str] = {
    "matched": "profile of 2.6 px full width that fits best (the barycentre where none fits within 1 px of it)",
    "barycentre": "five-pixel barycentre, as in [Boubenec2014]_",
    "three-point": "peak of the Gaussian, of any width, through three pixels, as in [FisherNaidu1996]_; for whiskers "
    "with others 3 to 5 px away (the barycentre where there is no such peak within 1 px of it)",
}


def code_of(estimator: str) -> int:
    """Place of an estimator in the table, by which the kernel knows it.

    Parameters
    ----------
    estimator : str
        One of ``ESTIMATORS``.

    Returns
    -------
    int
        From 0 on.
    """
    return get_args(Estimator).index(estimator)


def described() -> str:
    """All estimators in one sentence, for the help of commands.

    Returns
    -------
    str
        Names and what they do.
    """
    return "; ".join(f"{name}: {what.replace(']_', ']')}" for name, what in ESTIMATORS.items())
