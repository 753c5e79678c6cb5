"""Figures of one file: found by what is in it, refused under its own name."""

import numpy as np
import pytest
import xarray as xr

from vibrissa.errors import InputError
from vibrissa.files import save
from vibrissa.quantities import dataset
from vibrissa.study.gallery import REASONS, figure_of


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
    assert len(figure_of("9", tmp_path / "mouse_7.nc").axes) == 7


def test_a_file_that_does_not_serve_is_refused_by_its_name(tmp_path):
    save(dataset(time=np.arange(3.0)), tmp_path / "spikes.nc")
    with pytest.raises(InputError, match=r"figure 9 cannot be made of .*spikes\.nc \(no table of units"):
        figure_of("9", tmp_path / "spikes.nc")


def test_figures_of_the_model_say_for_which_studies_they_are_made():
    for name in ("gap", "gaps", "gain_map"):
        assert "made of [laboratory], sweeps or a surface alone" in REASONS[name]
        assert "no whisker" not in REASONS[name]
