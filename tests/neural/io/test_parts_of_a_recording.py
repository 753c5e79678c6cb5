"""A part of a population fires as among all; tables of spikes tell of their units; trials may be given as they are."""

import numpy as np
import populations
from refusals import refusal

from vibrissa.neural.io.recording import recorded_spikes
from vibrissa.neural.io.tables.spike_csv import read_spikes
from vibrissa.neural.io.tables.trials import trials_at
from vibrissa.neural.simulated.population import draw_population, record_population


def test_some_units_fire_as_they_do_among_all():
    rng = np.random.default_rng(0)
    truth = draw_population(rng=rng).isel(unit=slice(0, 514, 40))
    time, moved = populations.ringing(rng, duration=1.0, rate=2000.0)
    moved = np.array([np.roll(moved, 70 * k) for k in range(24)])
    whole = record_population(truth, time, moved, 5, rng=np.random.default_rng(3))
    places = np.array([2, 3, 11])
    part = record_population(truth, time, moved, 5, rng=np.random.default_rng(3), only=places)
    assert part.unit_name.values.tolist() == whole.unit_name.values[places].tolist()
    for k, place in enumerate(places):
        mine, theirs = part.spike_unit.values == k, whole.spike_unit.values == place
        np.testing.assert_array_equal(part.spike_time.values[mine], whole.spike_time.values[theirs])
        np.testing.assert_array_equal(part.spike_trial.values[mine], whole.spike_trial.values[theirs])
        assert mine.any()


def test_a_table_of_spikes_in_trials_tells_of_its_units(tmp_path):
    path = tmp_path / "spikes.csv"
    path.write_text("unit,trial,spike_time,quality,whisker\nb,0,1.5,MU,C1\na,0,1.0,SU,C2\na,1,0.5,SU,C2\n")
    table = read_spikes(path)
    assert table.unit_name.values.tolist() == ["a", "b"]
    assert table.unit_quality.values.tolist() == ["SU", "MU"]
    assert table.unit_whisker.values.tolist() == ["C2", "C1"]
    path.write_text("unit,trial,spike_time,quality\na,0,1.0,SU\na,1,0.5,MU\n")
    with refusal("format", "spikes.csv, line 3, quality"):
        read_spikes(path)


def test_trials_may_be_given_as_they_are(tmp_path):
    path = tmp_path / "session.csv"
    path.write_text("spike_time,unit\n10.25,a\n12.75,a\n12.25,b\n")
    spikes, count = recorded_spikes(path, window=(0, 1), trials=trials_at(np.array([10.0, 12.0]), 1.0))
    assert count == 2
    np.testing.assert_allclose(spikes.spike_time, [0.25, 0.75, 0.25])
    assert spikes.spike_trial.values.tolist() == [0, 1, 1]
    in_trials = tmp_path / "spikes.csv"
    in_trials.write_text("unit,trial,spike_time\na,0,1.0\n")
    with refusal("conflict", "period", f"{in_trials}, a table with a column trial"):
        recorded_spikes(in_trials, window=(0, 1), trials=trials_at(np.array([0.0]), 1.0))
    with refusal("conflict", "trial_table, only"):
        recorded_spikes(in_trials, window=(0, 1), trials="trials.csv", only=("a", "b"))
