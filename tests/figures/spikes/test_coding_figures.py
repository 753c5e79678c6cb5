"""Figures of surround maps and of the demodulation index: what their captions claim."""

import numpy as np
from refusals import refusal

from vibrissa.figures.spikes import demodulation, surround
from vibrissa.quantities import dataset

NAMES = np.array(["alpha", "C1", "C2", "D1"])


def a_map(names=NAMES):
    weight = np.array([[np.nan, 1e5, 2.5e5, -1e5]])
    return dataset(
        {"n_trials": 40},
        whisker=names,
        unit_name=np.array(["u"]),
        surround_weight=weight,
        surround_weight_low=weight - 2e4,
        surround_weight_high=weight + 2e4,
        surround_verdict=np.array([["cannot tell", "drives", "drives", "suppresses"]]),
        strongest_whisker=np.array(["C2"]),
        threshold=np.array([42e-6]),
        latency=np.array([0.012]),
        reason=np.array([""]),
        condition_number=2.0,
        copy_likeness=np.array([0.95, 0.1, 0.1, 0.2]),
    )


def test_caption_counts_the_verdicts():
    data = surround.compute({"surround": a_map()})
    for text in ("2 drive it", "1 suppress it", "1 cannot be determined", "42.0 µm", "12.0 ms"):
        assert text in data.attrs["caption"]
    pad = np.reshape(data.attrs["pad"], (-1, 2))
    assert pad.tolist() == [[0.5, 0], [2, 1], [2, 2], [3, 1]]


def test_map_is_drawn_with_whiskers_at_their_places():
    figure = surround.draw(surround.compute({"surround": a_map()}))
    assert len(figure.axes) == 4  # and the bar of colours
    with refusal("unknown", "whiskers"):
        surround.draw(surround.compute({"surround": a_map(np.array(["w1", "C1", "C2", "D1"]))}))


def units():
    index = np.array([-0.9, np.nan, 0.95])
    names = ("envelope_modulation", "phase_modulation", "demodulation_index")
    ends = {f"{name}{end}": index + step for name in names for end, step in (("", 0), ("_low", -0.1), ("_high", 0.1))}
    return dataset(
        {"n_trials": 40},
        unit_name=np.array(["p", "n", "e"]),
        demodulated=np.array(["phase", "cannot tell", "envelope"]),
        carrier_frequency=np.array([70.0]),
        envelope_coherence=np.array([0.0, 0.0, 0.6]),
        carrier_coherence=np.array([0.5, 0.0, 0.0]),
        **ends,
    )


def test_units_are_sorted_and_counted():
    data = demodulation.compute({"demodulation": units()})
    assert data.unit_name.values.tolist() == ["e", "p", "n"]
    assert "follow the envelope: 1, the phase: 1, both: 0; that cannot be assigned: 1" in data.attrs["caption"]
    assert len(demodulation.draw(data).axes) == 3
