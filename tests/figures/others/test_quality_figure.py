"""Picture of the quality of units: what is drawn where no unit has a signal to noise."""

import numpy as np
import pytest

from vibrissa.figures.others import unit_quality as figure
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.sorting.quality import unit_quality


@pytest.mark.parametrize(("snr", "label"), [(None, "rate [Hz]"), ([5.0, 9.0], "signal to noise")])
def test_violations_are_drawn_beside_what_is_measured(snr, label):
    rng = np.random.default_rng(0)
    known = {} if snr is None else {"snr_mean": np.array(snr)}
    spikes = spike_table(np.sort(rng.uniform(0, 100, 900)), rng.integers(0, 2, 900), ["a", "b"], **known)
    drawn = figure.draw(figure.compute(unit_quality(spikes)))
    axis = drawn.axes[1]
    assert axis.get_xlabel() == label
    assert np.isfinite(axis.collections[0].get_offsets()).all()
