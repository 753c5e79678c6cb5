"""Loops that Numba compiles once and keeps, until they or any loop that they call change.

Numba compares only the file of a loop itself. In a clone that is brought up to date, a loop would go on with the former
code of those that it calls in other files.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, TypeVar

import numba
import numpy as np
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher

_Function = TypeVar("_Function", bound=Callable[..., Any])
_VALUES = bool, int, float, complex, str, tuple, np.generic  # of global names, which are compiled in


def njit(**options: Any) -> Callable[[_Function], _Function]:
    """As ``numba.njit``; with ``cache=True`` compiled code is kept as long as all that is compiled in is the same.

    Parameters
    ----------
    **options
        Those of ``numba.njit``.

    Returns
    -------
    callable
        Decorator of a function.
    """

    def decorated(function: _Function) -> _Function:
        loop: _Function = numba.njit(**options)(function)
        if options.get("cache"):
            vars(loop)["_cache"] = _Kept(function)  # type: ignore[no-untyped-call]
        return loop

    return decorated


class _Kept(FunctionCache):
    """Compiled code on disk, under a key that holds the sources of all loops that it calls."""

    def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        return *super()._index_key(sig, codegen), compiled_in(self._py_func)  # type: ignore[no-untyped-call]

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except (AttributeError, ImportError):  # kept for a class that the code no longer has
            self.flush()  # type: ignore[no-untyped-call]
            return None


def compiled_in(function: FunctionType) -> str:
    """Digest of what is compiled into a loop: files of the loops that it calls, and values of global names.

    Parameters
    ----------
    function : function
        In Python, before it is compiled.

    Returns
    -------
    str
        Hexadecimal.
    """
    seen, waiting, parts = set[FunctionType](), [function], set[str]()
    while waiting:
        one = waiting.pop()
        seen.add(one)
        parts.add(_digest(one.__code__.co_filename))
        for name in _names(one.__code__):
            value = one.__globals__.get(name)
            if isinstance(value, Dispatcher) and value.py_func not in seen:
                waiting.append(value.py_func)
            elif isinstance(value, np.ndarray):
                parts.add(f"{name} {value.dtype} {value.shape} {value.tobytes().hex()}")
            elif isinstance(value, _VALUES):
                parts.add(f"{name} {value!r}")
    return hashlib.sha256("\n".join(sorted(parts)).encode()).hexdigest()


def _names(code: CodeType) -> Iterator[str]:
    """Global names and attributes in some code, and in that within it."""
    yield from code.co_names
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from _names(inner)


@cache
def _digest(file: str) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()
