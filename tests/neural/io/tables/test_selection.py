"""What xarray selects or sorts of a table of spikes keeps the spikes of each unit and trial with it."""

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

import vibrissa as vb
from vibrissa.figures.others.contents import compute
from vibrissa.neural.io.tables.selection import at_places, labelled
from vibrissa.neural.io.tables.spikes import of_unit, of_units, spike_table, with_intervals
from vibrissa.neural.io.tables.textures import textures_of
from vibrissa.neural.sorting.observed import trains_of
from vibrissa.study.archive.export_folder import read_results

TRAINS = {"a": [0.1, 0.2, 0.3, 1.1, 1.2, 1.3], "b": [0.5, 1.5], "c": [], "d": [0.4]}
SELECTIONS = {
    "one": lambda one: one.isel(unit=[1]),
    "reversed": lambda one: one.sortby("unit_name", ascending=False),
    "by label": lambda one: one.sel(unit=[3, 0]),
    "by mask": lambda one: one.isel(unit=one.unit_name.values != "a"),
    "again": lambda one: one.isel(unit=[3, 1, 0]).isel(unit=slice(1, 3)),
    "dropped": lambda one: one.drop_sel(unit=[0, 2]),
    "none left out": lambda one: one,
}


def trains(table):
    """Times of each unit, by its name, found by the place of the spikes."""
    return {
        str(name): table.spike_time.values[table.spike_unit.values == k].tolist()
        for k, name in enumerate(table.unit_name.values)
    }


@pytest.mark.parametrize("select", SELECTIONS.values(), ids=SELECTIONS)
def test_units_that_are_selected_keep_their_own_spikes(select):
    some = select(vb.read_spikes(TRAINS))
    names = some.unit_name.values.tolist()
    assert trains(at_places(some)) == {name: TRAINS[name] for name in names}
    assert trains(vb.read_spikes(some)) == {name: TRAINS[name] for name in names}
    rate = vb.unit_quality(some, duration=2.0).unit_rate.values
    np.testing.assert_allclose(rate, [len(TRAINS[name]) / 2 for name in names])
    rows = vb.to_dataframe(some).dropna()
    assert {name: rows.spike_time_s[rows.unit == name].tolist() for name in names} == {n: TRAINS[n] for n in names}


@pytest.mark.parametrize("select", SELECTIONS.values(), ids=SELECTIONS)
def test_a_group_of_selected_units_has_the_spikes_of_each(select):
    pytest.importorskip("pynapple")
    some = select(vb.read_spikes(TRAINS, trials=[(0.0, 2.0)]))
    group = vb.to_pynapple(some)
    found = {name: group[key].t.tolist() for key, name in zip(group.keys(), group["unit_name"], strict=True)}
    assert found == {name: TRAINS[name] for name in some.unit_name.values.tolist()}


def test_a_selection_is_kept_in_a_file(tmp_path):
    vb.save(vb.read_spikes(TRAINS).isel(unit=[3, 1]), tmp_path / "s.nc")
    assert trains(vb.read_spikes(tmp_path / "s.nc")) == {"d": [0.4], "b": [0.5, 1.5]}
    assert vb.unit_quality(tmp_path / "s.nc", duration=2.0).unit_rate.values.tolist() == [0.5, 1.0]


def test_trials_that_are_selected_keep_their_own_spikes():
    pytest.importorskip("pynapple")
    whole = vb.read_spikes(TRAINS, trials=[(0.0, 0.45), (0.45, 1.15), (1.15, 2.0)])
    some = vb.read_spikes(whole.isel(trial=[0, 2]))
    assert some.attrs["n_trials"] == some.sizes["trial"] == 2
    group = vb.to_pynapple(whole.isel(trial=[0, 2], unit=[1, 0]))
    np.testing.assert_allclose(group[0].t, [1.5])
    np.testing.assert_allclose(group[1].t, [0.1, 0.2, 0.3, 1.2, 1.3])
    swapped = at_places(whole.isel(trial=[2, 0]))
    np.testing.assert_allclose(
        swapped.spike_time + swapped.trial_start[swapped.spike_trial], [1.2, 1.3, 0.1, 0.2, 0.3, 1.5, 0.4]
    )


def test_intervals_of_observation_stay_with_their_units():
    spikes = spike_table([0.5, 1.0, 1.5], [0, 1, 1], ["a", "b"])
    seen = with_intervals(spikes, [np.array([[0.0, 1.0]]), np.array([[0.0, 2.0], [3.0, 5.0]])])
    first, second = trains_of(at_places(labelled(seen).isel(unit=[1, 0])))
    assert (first.duration, first.time.tolist()) == (4.0, [1.0, 1.5])
    assert (second.duration, second.time.tolist()) == (1.0, [0.5])


def test_what_was_found_of_selected_units_is_theirs():
    spikes, stimulus = vb.read_spikes(vb.sample_data("spikes.csv")), vb.sample_data("spikes-stimulus.csv")
    whole = vb.envelope_coupling(spikes, stimulus)
    some = vb.envelope_coupling(spikes.isel(unit=[2, 0]), stimulus)
    assert some.unit_name.values.tolist() == ["SU001", "MU001"]
    for name in ("envelope_correlation", "unit_rate"):
        np.testing.assert_array_equal(some[name], whole[name][[2, 0]])
    raster = vb.plot_unit(whole.isel(unit=[2]), "SU001").axes[0].lines[0].get_xdata()
    np.testing.assert_array_equal(raster, vb.plot_unit(whole, "SU001").axes[0].lines[0].get_xdata())


def test_one_unit_of_a_table_in_another_order_is_its_own():
    reordered = vb.read_spikes(TRAINS).isel(unit=[1, 0])
    assert trains(of_unit(reordered, "a")) == {"a": TRAINS["a"]}
    assert trains(vb.read_spikes(of_unit(reordered, "b"))) == {"b": TRAINS["b"]}
    assert trains(of_units(reordered, [1, 0])) == {name: TRAINS[name] for name in ("a", "b")}


def test_tables_without_labels_are_read_by_their_places():
    spikes = spike_table([0.5, 1.0], [0, 1], ["a", "b"], trial=[0, 1])
    xr.testing.assert_identical(at_places(spikes), spikes)
    xr.testing.assert_identical(at_places(labelled(spikes)), spikes)
    assert trains(vb.read_spikes(spikes.assign_coords(unit=[0, 1]))) == {"a": [0.5], "b": [1.0]}


@pytest.mark.parametrize(
    ("select", "rule"),
    [
        (lambda one: one.isel(unit=[0, 0]), ("conflict", "coordinate unit", "[0, 0]")),
        (lambda one: one.assign_coords(unit=["a", "b"]), ("conflict", "coordinate unit", "['a', 'b']")),
        (lambda one: one.drop_vars("unit").isel(unit=[0]), ("range", "spike_unit", "1")),
        (lambda one: one.assign(spike_unit=-one.spike_unit).drop_vars("unit"), ("range", "spike_unit", "-1")),
        (lambda one: one.isel(unit=1), ("shape", "spikes", "unit 1")),
        (lambda one: one.isel(trial=1), ("shape", "spikes", "trial 1")),
        (lambda one: one.drop_vars("trial").isel(trial=[0]), ("range", "spike_trial", "1")),
        (lambda one: one.assign(spike_unit=one.spike_unit + 0.5), ("format", "spike_unit", "float64 ('spike',)")),
        (
            lambda one: one.where(xr.DataArray([False, True], dims="unit"), drop=True),
            ("format", "spike_unit", "float64 ('spike', 'unit')"),
        ),
        (lambda one: one.swap_dims(unit="unit_name"), ("shape", "spikes", "unit along unit_name")),
        (
            lambda one: one.where(one.spike_time < 0.7, drop=True),
            ("format", "unit_name", f"{np.array('a', object).dtype} ('unit', 'spike')"),
        ),
    ],
)
def test_tables_whose_spikes_have_no_certain_unit_or_trial_are_refused(select, rule):
    whole = vb.read_spikes({"a": [0.5], "b": [1.5]}, trials=[(0.0, 1.0), (1.0, 2.0)])
    with refusal(*rule):
        vb.read_spikes(select(whole))


def test_remedies_for_tables_that_are_refused_serve():
    whole = vb.read_spikes(TRAINS)
    back = whole.swap_dims(unit="unit_name").swap_dims(unit_name="unit")
    assert trains(at_places(back)) == TRAINS
    assert trains(at_places(whole.isel(spike=whole.spike_time.values < 0.45)))["a"] == TRAINS["a"][:3]


def test_textures_of_selected_trials_are_those_of_their_numbers(tmp_path):
    (tmp_path / "t.csv").write_text("trial,texture\n0,rough\n1,smooth\n2,bare\n")
    whole = vb.read_spikes(TRAINS, trials=[(0.0, 0.45), (0.45, 1.15), (1.15, 2.0)])
    assert textures_of(at_places(whole.isel(trial=[2, 0])), tmp_path / "t.csv") == ["bare", "rough"]


def test_a_selection_that_was_saved_is_drawn_and_exported_by_its_places(tmp_path):
    vb.save(vb.read_spikes(TRAINS).isel(unit=[3, 1]), tmp_path / "mine.nc")
    drawn = compute(vb.load(tmp_path / "mine.nc"))
    assert trains(drawn) == trains(read_results(tmp_path)[0]["spikes"]) == {"d": [0.4], "b": [0.5, 1.5]}
