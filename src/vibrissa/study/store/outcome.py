"""Parts of a study that fail: their reasons are reported, and the rest continues."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from vibrissa.errors import ConvergenceError, InputError, MachineError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.spec.settings import Study

Failures = dict[str, str]
Attempt = Callable[[str, Callable[[], dict[str, "xr.Dataset"]]], dict[str, "xr.Dataset"]]

_NAMED = 5  # sweeps of one reason that are named one by one


def attempting(study: Study, failed: Failures) -> Attempt:
    """How the parts of a study are done: where one cannot be, the others continue, and the reason is noted.

    Parameters
    ----------
    study : Study
        What is asked. Where it has one part only its error is raised: nothing is left that could go on.
    failed : dict
        Takes the reasons, by part.

    Returns
    -------
    callable
        (name of a part, its work) → its datasets; none where it could not be done. What the machine refuses is raised.
    """
    one, many = study.movie or study.film, study.laboratory or study.sweeps is not None
    alone = [bool(part) for part in (one, many, study.only_surface, study.cortex)].count(True)
    return plainly if alone + len(study.base_signal) + len(study.neural) == 1 else noting(failed)


def noting(failed: Failures) -> Attempt:
    """Do parts of which each may fail; the reasons go to ``failed``, what the machine refuses is raised.

    Parameters
    ----------
    failed : dict
        Takes the reasons, by part.

    Returns
    -------
    callable
        (name of a part, its work) → its datasets.
    """

    def attempt(thing: str, work: Callable[[], dict[str, xr.Dataset]]) -> dict[str, xr.Dataset]:
        try:
            return work()
        except MachineError:
            raise
        except (InputError, ConvergenceError, OSError) as error:
            failed[thing] = str(error)
            return {}

    return attempt


def plainly(_: str, work: Callable[[], dict[str, xr.Dataset]]) -> dict[str, xr.Dataset]:
    """Do the work of a part; its error is raised.

    Parameters
    ----------
    _ : str
        Name of the part.
    work : callable
        Makes them.

    Returns
    -------
    dict of Datasets
        As made.
    """
    return work()


def not_analysed(results: Mapping[str, xr.Dataset], failed: Failures) -> list[str]:
    """A line for each part that could not be analysed, and for each reason for which sweeps could not.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study; of ``sweeps``, ``accepted`` and ``rejected`` are looked at.
    failed : dict
        Reasons by part, as :func:`attempting` notes them.

    Returns
    -------
    list of str
        One for each line.
    """
    lines = [f"{thing}: {reason}" for thing, reason in failed.items()]
    return lines + (_sweeps(results["sweeps"]) if "sweeps" in results else [])


def not_fitted(results: Mapping[str, xr.Dataset]) -> list[str]:
    """A line for each fit of a movie's resonances that lacks modes: which, and why.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study; the attribute ``left_out`` of ``resonance`` and ``resonance_white`` is looked at.

    Returns
    -------
    list of str
        One for each line.
    """
    forcings = {"resonance": "with the texture's forcing", "resonance_white": "with white forcing assumed"}
    why = {how: results[name].attrs.get("left_out") for name, how in forcings.items() if name in results}
    return [f"Not fitted {how}: {reason}." for how, reason in why.items() if reason]


def _sweeps(sweeps: xr.Dataset) -> list[str]:
    """Sweeps that were rejected, those of one reason together."""
    why: dict[str, list[str]] = {}
    rows = zip(sweeps.sweep.values, sweeps.accepted.values, sweeps.rejected.values, strict=True)
    for number, accepted, reason in rows:
        if not accepted:
            why.setdefault(str(reason), []).append(str(number))
    return [f"{_named(numbers)} of {sweeps.sizes['sweep']}: {reason}" for reason, numbers in why.items()]


def _named(numbers: list[str]) -> str:
    more = f" and {len(numbers) - _NAMED} more" if len(numbers) > _NAMED else ""
    return f"sweep{'s' if len(numbers) > 1 else ''} {', '.join(numbers[:_NAMED])}{more}"
