"""Which model predicts: the modes of a shaft with a single contact, or the whole whisker."""

from __future__ import annotations

from typing import Literal

from vibrissa.errors import UnknownError
from vibrissa.mechanics.rod.rod_settings import USUAL_ROD, Rod

Model = Literal["modes", "rod"] | Rod


def rod_of(model: Model, default: Rod = USUAL_ROD) -> Rod | None:
    """Settings of the rod that a model names; None of the modes.

    Parameters
    ----------
    model : {"modes", "rod"} or Rod
        As an argument of a public function.
    default : Rod
        What ``"rod"`` stands for.

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
        return default
    if model == "modes":
        return None
    raise UnknownError("model", "must be 'modes', 'rod' or a vb.Rod", repr(model))
