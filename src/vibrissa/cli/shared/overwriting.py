"""No verb replaces a file that it reads: refused before any work, also under another spelling or a link."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import is_dataclass
from inspect import Parameter as Argument
from inspect import signature
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import Beside, named
from vibrissa.errors import ConflictError


class _File(NamedTuple):
    """A path or a text of the command line that may be a file."""

    argument: str
    path: str
    alone: bool  # not one of a list
    hint: Any


def refuse_overwriting(verb: Callable[..., None], **given: object) -> None:
    """Refuse an output, or a file that is written beside it, that is an input of the same command line.

    Parameters
    ----------
    verb : callable
        Its annotations say which arguments are written: those of ``Out`` and ``MaybeOut``.
    given : object
        Its arguments, as the parser has read them.

    Raises
    ------
    InputError
        Names the output and the input.
    """
    files = list(_files(get_type_hints(verb, include_extras=True), given))
    read = [one for one in files if not _is_written(one.hint)]
    for output in (one for one in files if _is_written(one.hint)):
        for path in _all_written(output):
            for one in read:
                if _same(path, one.path):
                    raise _refusal(output, path, _said(one, verb))


def _files(hints: Mapping[str, Any], given: Mapping[str, object]) -> Iterator[_File]:
    """All paths and texts among arguments, those in groups of options too."""
    for name, value in given.items():
        if is_dataclass(value):
            yield from _files(get_type_hints(type(value), include_extras=True), vars(value))
        each = value if isinstance(value, list | tuple) else [value]
        for one in each:
            if isinstance(one, str | Path):
                yield _File(name, str(one), each is not value, hints.get(name))


def _is_written(hint: Any) -> bool:
    return any(isinstance(one, Parameter) and one.converter is named for one in _metadata(hint))


def _metadata(hint: Any) -> tuple[Any, ...]:
    return getattr(hint, "__metadata__", ())


def _all_written(output: _File) -> list[Path]:
    """The file that is named, and those that are written beside it."""
    path = Path(output.path)
    beside = [one for one in _metadata(output.hint) if isinstance(one, Beside)]
    return [path, *(path.with_name(form.format(path)) for one in beside for form in one.names)]


def _same(path: Path, other: str) -> bool:
    """Whether two names are one file that exists."""
    return os.path.isfile(path) and os.path.isfile(other) and os.path.samefile(path, other)


def _said(one: _File, verb: Callable[..., None]) -> str:
    """An input by its name: an option, or a word without one."""
    own = signature(verb).parameters.get(one.argument)
    if own is None or own.kind is Argument.KEYWORD_ONLY:
        return f"the file of --{one.argument.replace('_', '-')}"
    return f"the {one.argument}" if one.alone else f"one of the {one.argument}"


def _refusal(output: _File, path: Path, read: str) -> ConflictError:
    option = "--" + output.argument.replace("_", "-")
    also = "" if str(path) == output.path else f"also writes {path.name}, which "
    return ConflictError(option, f"{also}must not be {read}", output.path, "choose another name")
