"""Which model predicts: the modes of a shaft with a single contact, or the whole whisker."""

from __future__ import annotations

from typing import Literal

from vibrissa.errors import ConflictError, UnknownError
from vibrissa.mechanics.rod.rod_settings import USUAL_ROD, Rod

Model = Literal["modes", "free-end", "rod", "auto"] | Rod


def rod_of(model: Model) -> Rod | None:
    """Settings of the rod that a model names; None of the others.

    Parameters
    ----------
    model : {"modes", "free-end", "rod", "auto"} or Rod
        As an argument of a public function.

    Returns
    -------
    Rod or None
        The settings.

    Raises
    ------
    InputError
        If there is no such model.
    """
    if isinstance(model, Rod):
        return model
    if model == "rod":
        return USUAL_ROD
    if model in ("modes", "free-end", "auto"):
        return None
    raise UnknownError("model", "must be 'modes', 'free-end', 'rod', 'auto' or a vb.Rod", repr(model))


def refuse_forms(response: str, jump: str, modes: str, model: str = "rod") -> None:
    """Refuse forms of the model of modes, which the others do not have.

    Parameters
    ----------
    response, jump, modes : str
        As arguments of :func:`vibrissa.scan`.
    model : str
        The other.

    Raises
    ------
    InputError
        If one is not the default.
    """
    for name, value, usual in (
        ("response", response, "exact"),
        ("jump", jump, "continuous"),
        ("modes", modes, "straight"),
    ):
        if value != usual:
            raise ConflictError(name, f"must be left out with model={model!r}", repr(value))
