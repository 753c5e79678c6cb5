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


def test_spikes_of_trials_in_which_their_unit_was_not_observed_are_said_not_to_count():
    """Two units, observed to 25 and 45 s of 50 s, one of which goes on firing; trials of 10 s."""
    trials = trial_table(10.0 * np.arange(5), 10.0 * np.arange(5) + 10)
    ends = {"interval_start": [0.0, 0.0, 0.0], "interval_stop": [25.0, 45.0, 50.0], "interval_unit": [0, 1, 2]}
    spikes = spike_table([1.0, 21.0, 31.0, 41.0, 2.0, 12.0, 3.0], [0, 0, 0, 0, 1, 1, 2], ["a", "b", "c"])
    cut = cut_into_trials(spikes.merge(dataset(**ends)), trials)
    alone = cut.assign(unit_observed=cut.unit_observed | (cut.unit_name == "b"))
    which = "3 of its spikes lie in the others, which do not count"
    assert remarks_on(alone) == [f"unit a was observed in 2 of 5 trials; {which}"]
    both = "2 units were not observed in all trials, unit a in 2 of 5 trials, the fewest"
    assert remarks_on(cut) == [f"{both}; {which.replace('its', 'their')}"]
    silent = alone.isel(spike=np.flatnonzero(alone.spike_unit.values > 0))
    assert remarks_on(silent) == ["unit a was observed in 2 of 5 trials"]
