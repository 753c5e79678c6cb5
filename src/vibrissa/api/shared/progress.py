"""Progress of long work in a notebook: a bar under the cell that runs."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from importlib import import_module
from time import perf_counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vibrissa.quantities.kinds import Progress

EVERY = 0.2  # [s] from one change of a bar to the next


@contextmanager
def notebook_bar() -> Iterator[Progress]:
    """Report stages by a bar where Jupyter runs; elsewhere say nothing: scripts own their output.

    Returns
    -------
    iterator of callable
        Takes (stage, done, total).
    """
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if shell is None or not hasattr(shell, "kernel"):
        yield lambda stage, done, total: None
        return
    ipython: Any = import_module("IPython.display")
    handle, drawn = ipython.display(ipython.HTML(""), display_id=True), 0.0

    def report(stage: str, done: int, total: int) -> None:
        nonlocal drawn
        if perf_counter() - drawn > EVERY or done == total:
            drawn = perf_counter()
            handle.update(ipython.HTML(_bar(stage, done, total)))

    try:
        yield report
    finally:
        handle.update(ipython.HTML(""))


def _bar(stage: str, done: int, total: int) -> str:
    """One line of HTML: the bar, what is done, how much of it."""
    share: Any = f'value="{done}" max="{total}"' if total else ""
    return f"<progress {share}></progress> {escape(stage)}{f' {done} of {total}' if total else ''}"
