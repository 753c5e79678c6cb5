"""Spikes from neo: trains, segments and blocks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.api.objects.stretches import in_stretches
from vibrissa.arrays import Array, Window
from vibrissa.errors import FormatError, TooFewError, UnknownError
from vibrissa.neural.io.tables.spikes import table_of_trains, with_intervals
from vibrissa.neural.io.tables.trials import NEAR
from vibrissa.tables.kinds import described, is_a
from vibrissa.tables.table import LONGEST

NEO = ("SpikeTrain", "SpikeTrainProxy", "Segment", "Block")

_SHORT = 1e-3  # [s] by which trains of one recording may end apart, as by a sample


def neo_spikes(thing: Any) -> xr.Dataset:
    """Spikes of neo's objects: several segments are trials, one is a session.

    Parameters
    ----------
    thing : neo.SpikeTrain, list of them, neo.Segment, list of them, or neo.Block
        Times in any unit. Units are the trains, by their names, or in their order where none has a name; in every
        segment a unit has the same name, or the same place.

    Returns
    -------
    Dataset
        Of one segment, or of trains alone, on their clock, with t_start and t_stop of each as the ``interval`` in
        which the unit was observed. Of several as :func:`vibrissa.api.objects.stretches.in_stretches`: trials in which
        a train starts later or stops earlier than the longest of its segment, by more than 1 ms and elsewhere than at
        its own first or last spike, are not presented to its unit.

    Raises
    ------
    InputError
        If there is no train, two have one name, or only some have; as ``in_stretches``.
    """
    parts = thing.segments if is_a(thing, "neo", "Block") else thing if _is_list(thing) else [thing]
    if not all(is_a(part, "neo", "Segment") for part in parts):
        parts = [parts]
    segments = [_named([_loaded(train) for train in getattr(part, "spiketrains", part)]) for part in parts]
    names = list(dict.fromkeys(name for segment in segments for name in segment))
    if not names:
        raise TooFewError(described(thing), "must hold at least one SpikeTrain", 0)
    if len(segments) > 1:
        trains = [{name: _seconds(name, train) for name, train in one.items()} for one in segments]
        span = [_span(k, segment) for k, segment in enumerate(segments)]
        observed = [
            [_throughout(one.get(name), ends) for one, ends in zip(segments, span, strict=True)] for name in names
        ]
        return in_stretches(names, trains, span, {"source": described(thing)}, np.array(observed, bool))
    trains_of_one = [_seconds(name, train) for name, train in segments[0].items()]
    spikes = table_of_trains(trains_of_one, names, {"source": described(thing)})
    return with_intervals(spikes, [np.array([_ends(train)]) for train in segments[0].values()])


def _is_list(thing: Any) -> bool:
    return isinstance(thing, list | tuple) or is_a(thing, "neo", "SpikeTrainList")


def _loaded(train: Any) -> Any:
    if is_a(train, "neo", "SpikeTrainProxy"):
        return train.load()
    if not is_a(train, "neo", "SpikeTrain"):
        raise UnknownError("spikes", "must be SpikeTrains, or Segments, alone", described(train))
    return train


def _named(trains: Sequence[Any]) -> dict[str, Any]:
    """Trains by their names, or by their places where none has one."""
    names = [str(train.name or "") for train in trains]
    if not any(names):
        names = [str(k) for k in range(len(trains))]
    if "" in names or len(set(names)) < len(names):
        rule = "must all have names, each its own, or none in any"
        raise FormatError("SpikeTrains of a segment", rule, names, "train.name = 'unit 3'")
    return dict(zip(names, trains, strict=True))


def _seconds(name: str, train: Any) -> Array:
    time = np.asarray(train.rescale("s").magnitude, float)
    if not (np.abs(time) <= LONGEST).all():
        raise FormatError(f"SpikeTrain {name}", "must have finite spike times", f"{np.max(np.abs(time)):.6g} s")
    return time


def _ends(train: Any) -> Window:
    return float(train.t_start.rescale("s").magnitude), float(train.t_stop.rescale("s").magnitude)


def _throughout(train: Any, span: Window) -> bool:
    """Whether a train was recorded from the first start in its segment to the last stop; its own spikes are no ends."""
    if train is None:
        return False
    (start, stop), time = _ends(train), train.rescale("s").magnitude
    begun = start <= span[0] + _SHORT or (time.size > 0 and abs(time.min() - start) <= NEAR)
    return bool(begun and (span[1] <= stop + _SHORT or (time.size > 0 and abs(time.max() - stop) <= NEAR)))


def _span(k: int, segment: dict[str, Any]) -> Window:
    """First start and last stop of the trains of a segment [s]."""
    if not segment:
        remedy = "leave it out, or give it an empty SpikeTrain with its t_start and t_stop"
        raise TooFewError(f"segment {k}", "must hold a SpikeTrain, to know when it was recorded", 0, remedy)
    ends = np.array([_ends(train) for train in segment.values()])
    return float(ends[:, 0].min()), float(ends[:, 1].max())
