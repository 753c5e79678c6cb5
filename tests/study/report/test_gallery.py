"""Figures of one file: found by what is in it, refused under its own name."""

import numpy as np
import xarray as xr
from refusals import refusal

from vibrissa.figures.canvas import caption_of
from vibrissa.netcdf import save
from vibrissa.quantities import dataset
from vibrissa.study.report.gallery import figure_of
from vibrissa.study.stages.figure_table import ABSENT


def units():
    n, rng = 12, np.random.default_rng(0)
    columns = {
        "unit_quality": np.where(np.arange(n) % 3 == 0, "SU", "MU"),
        "significant": np.ones(n, bool),
        "identified": np.ones(n, bool),
        "threshold": rng.normal(43e-6, 5e-6, n),
        "slope": rng.lognormal(np.log(0.25e6), 0.3, n),
        "latency": np.full(n, 0.01),
        "baseline": np.full(n, 5.0),
    }
    return xr.Dataset({name: ("unit", values) for name, values in columns.items()})


def test_a_table_of_units_is_known_by_what_it_holds(tmp_path):
    save(units(), tmp_path / "mouse_7.nc")
    assert len(figure_of("9", tmp_path / "mouse_7.nc").axes) == 6  # without D: nothing was recorded before the stimulus


def test_a_file_that_does_not_serve_is_refused_by_its_name(tmp_path):
    save(dataset(time=np.arange(3.0)), tmp_path / "spikes.nc")
    with refusal("unknown", "figure 9"):
        figure_of("9", tmp_path / "spikes.nc")


def recording(folder, end, name):
    """Save what a study writes of one recording; its name is in the captions of both figures."""
    n, rng = 120, np.random.default_rng(len(name))
    save(units().assign_attrs(label=name, note=f" Of {name}."), folder / f"units{end}.nc")
    spikes = dataset(spike_time=rng.uniform(0, 1, 40), spike_trial=rng.integers(0, 5, 40))
    save(spikes.assign_attrs(source=name), folder / f"spikes{end}.nc")
    rates = {"firing_rate": rng.uniform(0, 50, n), "bin_envelope": rng.uniform(0, 1e-4, n)}
    response = dataset({"bin_width": 0.01, "n_trials": 5}, bin=0.01 * np.arange(n), **rates)
    save(response, folder / f"response{end}.nc")


def caption(number, given):
    return caption_of(figure_of(number, given))


def test_of_several_recordings_one_must_be_chosen_and_is_drawn(vibrissa, tmp_path):
    for end, name in (("_2", "second"), ("_10", "tenth")):
        recording(tmp_path, end, name)
    for number in "89":
        code, out, err = vibrissa("figure", number, tmp_path, "--out", tmp_path / "figure.png")
        assert (code, out) == (2, "")
        told = f"{tmp_path} holds 2: units_2.nc (second), units_10.nc (tenth); give {tmp_path / 'units_10.nc'}, say"
        assert err == f"vibrissa: figure {number} must be of one recording, and {told}\n"
        assert not (tmp_path / "figure.png").exists()
    assert "of second" in caption("8", tmp_path / "units_2.nc")
    assert "of tenth" in caption("8", tmp_path / "spikes_10.nc")
    assert caption("9", tmp_path / "units_2.nc").endswith("Of second.")


def test_the_only_recording_of_a_folder_is_drawn_whatever_its_number(tmp_path):
    recording(tmp_path, "_1", "only")
    assert "of only" in caption("8", tmp_path)
    assert caption("9", tmp_path).endswith("Of only.")


def test_a_population_beside_recordings_keeps_its_figures(tmp_path):
    for end, name in (("", "cortex"), ("_1", "first"), ("_2", "second")):
        recording(tmp_path, end, name)
    assert "of cortex" in caption("8", tmp_path)
    assert caption("9", tmp_path).endswith("Of cortex.")


def test_figures_of_the_model_say_for_which_studies_they_are_made():
    for name in ("gap", "gaps", "gain_map"):
        assert "made of [laboratory], sweeps or a surface alone" in ABSENT[name]
        assert "no whisker" not in ABSENT[name]


def test_a_damaged_file_beside_does_not_stop_a_figure(tmp_path):
    recording(tmp_path, "", "whole")
    (tmp_path / "sweeps.nc").write_bytes(b"damaged")
    assert "Of whole" in caption("9", tmp_path)
    (tmp_path / "units.nc").write_bytes(b"damaged")
    with refusal("format", "units.nc"):
        figure_of("9", tmp_path)


def test_a_file_of_another_name_is_refused_with_the_name_that_it_must_have(tmp_path):
    save(dataset(time=np.arange(3.0)), tmp_path / "scan_v.nc")
    with refusal("unknown", "figure surface") as caught:
        figure_of("surface", tmp_path / "scan_v.nc")
    assert "a file must have the name of the result, scan.nc" in str(caught.value)
    with refusal("unknown", "figure 5") as caught:
        figure_of("5", tmp_path / "scan_v.nc")
    assert "give the folder that holds " in str(caught.value)
    assert ".nc and " in str(caught.value)
