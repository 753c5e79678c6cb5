"""Files read through packages of others: a package that may be missing, and whatever fails inside one."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from reprlib import repr as short
from typing import Any

from vibrissa.errors import FormatError, InputError, PackageError, install


def optional_module(name: str, thing: str, extra: str) -> Any:
    """Import a module of an extra.

    Parameters
    ----------
    name : str
        The module.
    thing : str
        What needs it, for the message.
    extra : str
        The extra of ``pyproject.toml`` that brings it.

    Returns
    -------
    module
        The module.

    Raises
    ------
    InputError
        If it is not installed; the remedy is the command that installs it.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise PackageError(thing, f"needs {name.partition('.')[0]}", remedy=install(extra)) from error


@contextmanager
def one_line(thing: str, rule: str, remedy: str = "") -> Iterator[None]:
    """Turn whatever fails inside a package of others into one line, and keep its warnings back.

    Parameters
    ----------
    thing, rule, remedy : str
        As in :class:`~vibrissa.errors.InputError`; the cause is added to the rule.

    Returns
    -------
    iterator of None
        For ``with``.

    Raises
    ------
    InputError
        For any exception inside, of whatever kind; one of our own passes as it is.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except Exception as error:
        cause = f"{type(error).__name__}: {short(' '.join(str(error).split()))}"
        raise FormatError(thing, f"{rule} ({cause})", None, remedy) from error
