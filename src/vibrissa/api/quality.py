"""Quality of units: which are kept by which rules, and why the others are not."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

from vibrissa.api.remarks import remark
from vibrissa.api.shared.arguments import names_arguments

if TYPE_CHECKING:
    import xarray as xr


@names_arguments
def unit_quality(
    spikes: Any,
    *,
    duration: float | None = None,
    window: tuple[float, float] | None = None,
    trials: Any = None,
    refractory_period: float = 1e-3,
    least_rate: float = 1.0,
    most_violations: float = 0.0,
    most_contamination: float | None = None,
    least_snr: float | None = None,
    least_presence: float | None = None,
    most_change: float | None = None,
    need_measured: bool = False,
) -> xr.Dataset:
    """Which units are kept, and why the others are left out: rate, refractoriness, signal to noise, stability.

    Parameters
    ----------
    spikes : Dataset or any object that ``read_spikes`` takes
        On the session's clock or in trials; of a folder units of all labels are taken, each in its class.
    duration : float, optional
        Length of the session [s], where the spikes do not state it; from first to last spike by default.
    window : (float, float), optional
        Part of each trial that is judged, half-open [s]; by default all of it, of spikes that were cut into trials.
    trials : optional
        Onsets and ends of the trials within which units are judged, as ``read_spikes`` takes them; else the session.
    refractory_period : float
        Below it a single unit has no interval [s].
    least_rate : float
        Rate above which a unit is kept [Hz].
    most_violations, most_contamination : float, optional
        Largest share of intervals below the period, and of foreign spikes; of good and unlabelled units.
    least_snr, least_presence : float, optional
        Least signal to noise, and least share of the recording in which a unit fires.
    most_change : float, optional
        Largest change of rate and amplitude from start to end, over their mean.
    need_measured : bool
        Whether units are left out for which a rule given here is not measured.

    Returns
    -------
    Dataset
        On (unit): ``unit_class`` (good, mua, unlabelled), ``unit_rate`` [Hz], ``unit_snr`` and ``snr_source``,
        ``refractory_violations``, ``contamination`` with ``_low`` and ``_high``, ``presence_ratio``, ``rate_change``,
        ``amplitude_change``, ``kept`` and ``reason``. NaN is not measured.

    Raises
    ------
    InputError
        If the spikes cannot be read, or the options do not fit them.

    Examples
    --------
    >>> import vibrissa as vb
    >>> quality = vb.unit_quality({"a": [0.1, 0.2, 0.4, 0.7], "b": [0.3]}, duration=1.0)
    >>> quality.reason.values.tolist()
    ['', 'rate 1 Hz is not above 1 Hz']
    """
    from vibrissa.api.objects.spikes import object_spikes, without_trials
    from vibrissa.api.objects.trials import as_trials
    from vibrissa.neural.io.recording import session_spikes, with_waveforms
    from vibrissa.neural.sorting.quality import Inclusion, remarks_on_quality
    from vibrissa.neural.sorting.quality import unit_quality as judge
    from vibrissa.study.neurons.observed_units import observed_units

    rules = Inclusion(
        refractory_period=refractory_period,
        least_rate=least_rate,
        most_violations=most_violations,
        most_contamination=most_contamination,
        least_snr=least_snr,
        least_presence=least_presence,
        most_change=most_change,
        need_measured=need_measured,
    )
    is_path = isinstance(spikes, str | PathLike)
    table = with_waveforms(session_spikes(spikes, groups=("all",)), spikes) if is_path else object_spikes(spikes)[0]
    if window is not None and trials is None and "spike_trial" not in table:
        raise without_trials(window)
    known = None if trials is None else as_trials(trials, window=window)
    seen, remarks = observed_units(table, known, window=window, duration=duration)
    quality = judge(seen, rules=rules)
    remark(*remarks, *remarks_on_quality(quality))
    return quality
