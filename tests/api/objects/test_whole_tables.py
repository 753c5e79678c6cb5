"""Tables that say all they hold, or are refused: trials not observed, overlapping trials, numbers of trials."""

import numpy as np
import pytest
from refusals import refusal

import vibrissa as vb
from vibrissa.api.remarks import Remark
from vibrissa.neural.coding.information import unit_information
from vibrissa.neural.io.tables.spike_csv import read_spikes, write_csv
from vibrissa.neural.io.tables.spikes import spike_table, with_intervals
from vibrissa.neural.io.tables.trials import trial_table
from vibrissa.study.neurons.observed_units import observed_units

STIMULUS = vb.sample_data("spikes-stimulus.csv")


def table(observed):
    return spike_table([0.1, 0.2], [0, 1], ["a", "b"], trial=[0, 1], attrs={"n_trials": 2}, unit_observed=observed)


def test_trials_that_were_not_observed_do_not_become_silent_ones(tmp_path):
    for write in (vb.to_dataframe, lambda spikes: write_csv(spikes, tmp_path / "s.csv")):
        with refusal("too-few", "units", "1 of 2 for 'b'"):
            write(table([[True, True], [False, True]]))
    assert not (tmp_path / "s.csv").exists()
    write_csv(table(np.ones((2, 2), bool)), tmp_path / "s.csv")
    assert read_spikes(tmp_path / "s.csv").spike_time.values.tolist() == [0.1, 0.2]


def test_a_result_of_units_is_a_row_for_each_of_them():
    units = vb.envelope_coupling(vb.sample_data("spikes.csv"), STIMULUS)
    frame = vb.to_dataframe(units)
    assert len(frame) == units.sizes["unit"]
    assert frame.unit_name.tolist() == units.unit_name.values.tolist()
    np.testing.assert_array_equal(frame.threshold_m, units.threshold)
    assert frame.significant.tolist() == units.significant.values.tolist()


def test_overlapping_trials_are_remarked_on():
    session, trials = {"a": [0.5, 1.5, 2.5]}, [(0.0, 2.0), (1.0, 3.0)]
    with pytest.warns(Remark, match="1 spikes lie in two trials, which overlap, and count in both"):
        assert vb.read_spikes(session, trials=trials).sizes["spike"] == 4
    spikes = with_intervals(vb.read_spikes(session), [np.array([[0.0, 9.0]])])
    said = observed_units(spikes, trial_table(*np.transpose(trials)))[1]
    assert said[1] == "1 trials begin before the one before them ends; what they share counts once"
    assert len(observed_units(spikes, trial_table([0.0, 2.0], [2.0, 3.0]))[1]) == 1


@pytest.mark.parametrize(("number", "code"), [(20.5, "range"), ("20", "format"), (np.nan, "range")])
def test_a_number_of_trials_is_whole(number, code):
    spikes = vb.read_spikes(vb.sample_data("spikes.csv")).drop_attrs()
    with refusal(code, "n_trials"):
        vb.envelope_coupling(spikes, STIMULUS, n_trials=number)
    with refusal(code, "number of trials"):
        unit_information(spikes, number, window=(0.0, 1.0))
