"""Threads of the numerical libraries: one each, because sums of several differ in the last bit."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_SETTINGS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def single_threaded() -> Any:
    """Limit this process to one thread of each library; undone by ``with``."""
    import scipy.linalg  # noqa: F401 (its BLAS is another than NumPy's, and is only limited once it is there)
    from threadpoolctl import threadpool_limits

    return threadpool_limits(1)


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Let processes that start now use one thread each."""
    before = {name: os.environ.get(name) for name in _SETTINGS}
    os.environ.update(dict.fromkeys(_SETTINGS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
