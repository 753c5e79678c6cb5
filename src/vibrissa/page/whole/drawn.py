"""What the page draws of a scan of the whole whisker."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibrissa.page.signals import arrays_of

if TYPE_CHECKING:
    from vibrissa.neural.simulated.virtual import ThresholdLinearUnit
    from vibrissa.page.signals import Arrays
    from vibrissa.page.whole.job import WholeJob, WholeScan


def whole_arrays(scan: WholeScan, job: WholeJob, unit: ThresholdLinearUnit) -> Arrays:
    """Everything drawn of a scan of the whole whisker.

    Parameters
    ----------
    scan : WholeScan
        The scan.
    job : WholeJob
        Of it.
    unit : ThresholdLinearUnit
        The neuron.

    Returns
    -------
    dict
        As of :func:`vibrissa.page.signals.arrays_of`.
    """
    return arrays_of(scan.record, unit, job.surface, scan.facts["frequency"][-1], scan.facts["timescale"])
