"""Errors of the public functions name the argument that was wrong."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import ParamSpec, TypeVar

from vibrissa.errors import FormatError, InputError, UnknownError, did_you_mean

# names inside the rooms whose arguments have shorter ones here
SHORTER = {"sampling_rate": "rate", "node": "nodes", "trials": "n_trials", "number_of_units": "units"}
SHORTER |= {"number_of_modes": "n_modes", "threshold": "least_contrast", "level": "levelling", "scale": "factor"}
SHORTER |= {"texture": "surface", "relief": "surface", "signal": "stimulus", "gap_width": "width"}
# what an argument of a kind must be, and how to write it
KINDS = {
    "Whisker": (("Whisker",), 'vb.Whisker(length=0.04, cone_angle=1.5e-3), or vb.atlas("C2")'),
    "Posture": (("Posture",), "vb.Posture(contact=0.29, base_angle=1.2)"),
    "Posture | None": (("Posture", "NoneType"), "vb.Posture(contact=0.29, base_angle=1.2)"),
    "Posture | PosturePath | BasePath": (
        ("Posture", "PosturePath", "BasePath"),
        "vb.Posture(contact=0.29, base_angle=1.2)",
    ),
    "Gaps | HeightProfile": (
        ("Gaps", "HeightProfile"),
        "vb.HeightProfile(x, height), vb.Gaps(position, width), or vb.read_surface(path)",
    ),
    "xr.Dataset": (("Dataset",), "a Dataset that a function of vibrissa has made"),
    "float": (("float", "int", "float64", "float32", "int64", "int32"), "a number in SI units: 0.1 for 100 mm/s"),
}
Given = ParamSpec("Given")
Result = TypeVar("Result")


def names_arguments(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """Let errors of a function name its own argument (``speed``), not the setting behind it (``Scan.speed``).

    Parameters
    ----------
    function : callable
        A public function.

    Returns
    -------
    callable
        The same, whose errors are renamed where the last word of their quantity is an argument.
    """
    form = signature(function)
    arguments = form.parameters

    @wraps(function)
    def call(*args: Given.args, **words: Given.kwargs) -> Result:
        unknown = [word for word in words if word not in arguments and "how" not in arguments]
        if unknown:
            near = did_you_mean(unknown[0], arguments, f"it takes {', '.join(arguments)}")
            raise UnknownError(unknown[0], f"must be an argument of {function.__name__}", None, near)
        for name, value in form.bind_partial(*args, **words).arguments.items():
            refuse_kind(name, value, str(arguments[name].annotation))
        try:
            return function(*args, **words)
        except InputError as error:
            name = error.quantity.rpartition(".")[2].removeprefix("--").replace("-", "_").replace(" ", "_")
            name = name if name in arguments else SHORTER.get(name, name)
            if name == error.quantity or name not in arguments:
                raise
            raise error.renamed(name) from None

    return call


def refuse_kind(name: str, value: object, annotation: str) -> None:
    """Refuse a value of another kind than its argument takes, where the kind is one of ``KINDS``.

    Parameters
    ----------
    name : str
        The argument.
    value : object
        What was given.
    annotation : str
        As the function is annotated.

    Raises
    ------
    InputError
        Shows the right form.
    """
    kinds, form = KINDS.get(annotation, ((), ""))
    given = type(value).__name__
    if kinds and given not in kinds:
        found = repr(value) if isinstance(value, str | int | float) else f"a {given}"
        known = [kind for kind in kinds if kind != "NoneType"][:2]
        rule = "must be a number" if annotation == "float" else f"must be of the class {' or '.join(known)}"
        raise FormatError(name, rule, found, form)
