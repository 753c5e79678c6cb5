"""What SpikeInterface compiles is kept on disk, so that it is compiled once and not for every recording."""

from __future__ import annotations

import sys
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec

PACKAGE = "spikeinterface"
COMPILED = (  # its modules with loops that Numba compiles, which are imported when a sorter runs
    "curation.auto_merge",
    "curation.curation_tools",
    "metrics.quality.misc_metrics",
    "postprocessing.correlograms",
    "postprocessing.isi",
    "postprocessing.template_similarity",
    "sortingcomponents.clustering.isosplit_isocut",
    "sortingcomponents.matching.tdc_peeler",
    "sortingcomponents.peak_detection.locally_exclusive",
    "sortingcomponents.peak_detection.matched_filtering",
)


def keep_compiled(package: str = PACKAGE, modules: tuple[str, ...] = COMPILED) -> list[str]:
    """Let Numba keep the compiled loops of a package on disk: beside its sources, or in NUMBA_CACHE_DIR.

    Parameters
    ----------
    package : str
        Its name.
    modules : tuple of str
        Those of its modules that have such loops; one that is not there is passed over.

    Returns
    -------
    list of str
        Names of the loops.
    """
    from numba.core.dispatcher import Dispatcher

    kept = []
    for name in modules:
        full = f"{package}.{name}"
        with suppress(ModuleNotFoundError):  # another version has it elsewhere, and compiles it each time
            if full not in sys.modules and find_spec(full) is None:
                continue
            for loop in vars(import_module(full)).values():
                if isinstance(loop, Dispatcher) and loop.py_func.__module__ == full:
                    loop.enable_caching()
                    kept.append(f"{full}.{loop.py_func.__name__}")
    return kept
