"""Errors of the public functions name the argument that was wrong."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Sequence
from functools import wraps
from inspect import signature
from reprlib import repr as short
from typing import Any, ParamSpec, TypeVar

import numpy as np

from vibrissa.errors import FormatError, InputError, RangeError, ShapeError, UnknownError, did_you_mean
from vibrissa.tables.kinds import is_quantity
from vibrissa.tables.stated import bare, number, numbers

# names inside the rooms whose arguments have shorter ones here
SHORTER = {"sampling_rate": "rate", "node": "nodes", "trials": "n_trials", "number_of_units": "units"}
SHORTER |= {"number_of_modes": "n_modes", "threshold": "least_contrast", "level": "levelling", "scale": "factor"}
SHORTER |= {"texture": "surface", "relief": "surface", "signal": "stimulus", "gap_width": "width", "flip": "reverse"}
# what an argument of a kind must be, and how to write it
PLAIN = "without a unit, in SI: 0.01 for 10 mm or 10 ms, 0.1 for 100 mm/s"
WHOLE = "int", "int64", "int32"
NUMBERS = "float", "float64", "float32", *WHOLE
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
    "float": (NUMBERS, PLAIN),
    "float | None": ((*NUMBERS, "NoneType"), PLAIN),
    "float | Posture": ((*NUMBERS, "Posture"), "the contact over L, such as 0.29, or a vb.Posture"),
    "int": (WHOLE, "such as 3"),
}
ANY = (-1,)  # shape of a list of any length
PAIRS = "Window", "Seconds | None", "tuple[float, float] | None", "tuple[float, float]"
# arguments of several numbers: the shapes of their array, and what they must be
LISTS = {
    "Sequence[float] | float | None": (((), ANY), "must be numbers in SI"),
    **dict.fromkeys(("Sequence[float]", "Sequence[float] | None"), ((ANY,), "must be a list of numbers")),
    "Sequence[int] | None": ((ANY,), "must be a list of whole numbers"),
    **dict.fromkeys(PAIRS, (((2,),), "must be two numbers")),
    "Point | None": (((2,),), "must be a point, (x, y) [m]"),
    **dict.fromkeys(
        ("Line | None", "tuple[Point, Point] | None"), (((2, 2),), "must be two points, ((x, y), (x, y)) [m]")
    ),
}
# SI units of arguments whose numbers may state theirs; others have none, or are of several kinds
IN_SI = {
    "s": "bin_width skip window spontaneous delays duration refractory_period exposure fade ramp",
    "Hz": "band frame_rate guess high low least_rate rate whisking_band",
    "m": "base_part depth distance excursion face length_sd mean_envelope part physical_length pixel_size pole "
    "pole_radius skin_sd touch_distance wall whisker_length width",
    "m/s": "speed",
}
UNIT_OF = {name: unit for unit, names in IN_SI.items() for name in names.split()}
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
        given = form.bind_partial(*args, **words)
        for name, value in given.arguments.items():
            given.arguments[name] = as_kind(name, value, str(arguments[name].annotation))
        try:
            return function(*given.args, **given.kwargs)
        except InputError as error:
            here = in_arguments(error, arguments)
            if str(here) == str(error):
                raise
            raise here from None

    return call


def in_arguments(error: InputError, arguments: Collection[str]) -> InputError:
    """An error in the words of a function: its arguments, also those that a remedy gives in backquotes.

    Parameters
    ----------
    error : InputError
        In the words of the rooms inside.
    arguments : collection of str
        Of the function.

    Returns
    -------
    InputError
        Of the same class.
    """

    def called(name: str) -> str:
        other = SHORTER.get(name, name)
        return other if name not in arguments and other in arguments else name

    name = called(error.quantity.rpartition(".")[2].removeprefix("--").replace("-", "_").replace(" ", "_"))
    rule, remedy = (re.sub(r"(?<=`)\w+", lambda word: called(word[0]), text) for text in (error.rule, error.remedy))
    return type(error)(name if name in arguments else error.quantity, rule, error.value, remedy)


def as_kind(name: str, value: Any, annotation: str) -> Any:
    """A value of the kind that its argument takes, where that is one of ``KINDS`` or ``LISTS``; others are refused.

    Parameters
    ----------
    name : str
        The argument.
    value : object
        What was given.
    annotation : str
        As the function is annotated.

    Returns
    -------
    object
        The value; a number of another class as ``float`` or ``int``, an array as tuples.

    Raises
    ------
    InputError
        Shows the right form.
    """
    if choices := re.fullmatch(r"Literal\[([^\[\]]*)\]", annotation):
        _refuse_choice(name, value, re.findall(r"[\w-]+", choices[1]))
    kinds, form = KINDS.get(annotation, ((), ""))
    if annotation in LISTS and value is not None:
        return listed(name, value, annotation, UNIT_OF.get(name))
    given = type(value).__name__
    if "float" in kinds and (given not in kinds or hasattr(value, "dtype")) and not isinstance(value, str | bool):
        return number(name, value, None if is_quantity(value) else UNIT_OF.get(name), form)
    if kinds == WHOLE and np.ndim(value) == 0 and np.asarray(value).dtype.kind in "iu":
        value, given = int(value), "int"
    if kinds and given not in kinds:
        found = repr(value) if isinstance(value, str | int | float) else f"a {given}"
        known = [kind for kind in kinds if kind != "NoneType"][:2]
        rule = "must be a number" if "float" in kinds else f"must be of the class {' or '.join(known)}"
        rule = "must be a whole number" if kinds == WHOLE else rule
        raise FormatError(name, rule, found, form)
    if name == "seed" and kinds == WHOLE and value < 0:
        raise RangeError(name, "must be 0 or a positive whole number", value)
    return value


def listed(name: str, value: Any, annotation: str, unit: str | None = None) -> Any:
    """Numbers of one of the shapes that an argument takes.

    Parameters
    ----------
    name : str
        The argument.
    value : array_like
        In SI, or with a unit: see :func:`vibrissa.tables.stated.bare`.
    annotation : str
        One of ``LISTS``.
    unit : str, optional
        SI unit; default: that of the value.

    Returns
    -------
    object
        Lists of plain numbers as they are, others as tuples in SI.

    Raises
    ------
    InputError
        If they are no numbers, or too many or too few.
    """
    shapes, rule = LISTS[annotation]
    found = numbers(name, value, unit)
    if found.shape not in shapes and not (ANY in shapes and found.ndim == 1):
        raise ShapeError(name, rule, short(value))
    if _plain(value):
        return value
    given = np.asarray(bare(value, unit))
    plain = (given if given.dtype.kind in "iu" and np.array_equal(given, found) else found).tolist()
    return tuple(tuple(one) if isinstance(one, list) else one for one in plain) if found.ndim else plain


def _plain(value: Any) -> bool:
    """Whether it is a number of Python, or a list of such."""
    several = isinstance(value, list | tuple | range)
    return all(map(_plain, value)) if several else isinstance(value, int | float)


def _refuse_choice(name: str, value: object, choices: Sequence[str]) -> None:
    """Refuse an unknown word for an argument; name those that it takes."""
    if choices and value not in choices:
        near = did_you_mean(str(value), choices)
        raise UnknownError(name, f"must be one of {', '.join(choices)}", repr(value), near)
