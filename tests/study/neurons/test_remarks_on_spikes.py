"""What is said of spikes that are left out."""

import numpy as np
from refusals import refusal

from vibrissa.neural.io.tables.inputs import refuse_misplaced
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.stimuli import labelled_stimulus
from vibrissa.neural.io.tables.trials import cut_into_trials, trial_table
from vibrissa.quantities import dataset
from vibrissa.study.neurons.inputs import remarks_on


def test_spikes_left_out_by_the_window_are_not_said_to_lie_in_no_trial():
    spikes = spike_table(np.array([0.5, 2.0, 9.5, 12.0]), np.zeros(4, int), ["a"])
    trials = trial_table(np.array([0.0]), np.array([10.0]))
    assert remarks_on(cut_into_trials(spikes, trials)) == ["1 spikes lie in no trial and are left out"]
    found = remarks_on(cut_into_trials(spikes, trials, (1.0, 9.0)))
    assert found == ["3 spikes lie outside 1 to 9 s of every trial and are left out"]


def test_a_trial_across_two_intervals_that_touch_was_observed():
    spikes = spike_table([1.0, 2.0], [0, 1], ["a", "b"])
    ends = {
        "interval_start": [0.0, 5.0, 0.0, 5.1],
        "interval_stop": [5.0, 9.0, 5.0, 9.0],
        "interval_unit": [0, 0, 1, 1],
    }
    spikes = spikes.merge(dataset(**ends))
    cut = cut_into_trials(spikes, trial_table(np.array([1.0, 4.0]), np.array([3.0, 6.0])))
    assert cut.unit_observed.values.tolist() == [[True, True], [True, False]]


def test_counts_from_the_onset_have_no_spontaneous_window_before_it():
    counted = {"counted_bins": 300, "counted_bin": 0.01}
    spikes = spike_table([0.5], [0], ["a"], trial=[0], attrs=counted)
    stimulus = labelled_stimulus(np.arange(300) / 100, np.ones(300), envelope=True)
    refuse_misplaced(spikes, stimulus, 1, spontaneous=(0.0, 0.5))
    with refusal("range", "spontaneous"):
        refuse_misplaced(spikes, stimulus, 1, spontaneous=(-1.0, 0.0))
