"""The one table: what it labels and what it refuses."""

import pkgutil
from importlib import import_module

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

from vibrissa import __version__, quantities
from vibrissa.quantities import QUANTITIES, dataset, require


@pytest.mark.parametrize("name", QUANTITIES)
def test_every_quantity_is_labelled_with_its_unit_and_dimensions(name):
    quantity = QUANTITIES[name]
    n = len(quantity.dims)
    data = dataset(**{name: np.arange(2.0**n).reshape([2] * n)})
    assert data[name].dims == quantity.dims
    assert data[name].attrs == {"units": quantity.unit, "long_name": quantity.long_name}
    require(data, name)


def test_dimensions_that_are_given_become_coordinates():
    data = dataset(mode=[1, 2], kappa=[3.0, 4.0], contact=0.3)
    assert list(data.coords) == ["mode"]
    assert set(data.data_vars) == {"kappa", "contact"}
    assert float(data.kappa.sel(mode=2)) == 4.0
    assert data.attrs == {"vibrissa_version": __version__}


def test_whiskers_may_lead():
    data = dataset(lead=("whisker",), kappa=np.zeros((3, 2)), contact=[0.1, 0.2, 0.3], mode=[1, 2])
    assert data.kappa.dims == ("whisker", "mode")
    assert data.contact.dims == ("whisker",)
    assert data["mode"].dims == ("mode",)
    require(data, "kappa", "contact")


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: dataset(stiffness=1.0), ("unknown", "stiffness")),
        (lambda: dataset(kappa=1.0), ("shape", "kappa")),
        (lambda: dataset(kappa=np.zeros((2, 2))), ("shape", "kappa")),
        (lambda: dataset(lead=("whisker", "trial"), contact=[0.1]), ("shape", "contact")),
    ],
)
def test_arrays_that_do_not_fit_the_table_are_refused(call, rule):
    with refusal(*rule):
        call()


def test_lengths_that_disagree_are_refused():
    with pytest.raises(ValueError, match="mode"):
        dataset(mode=[1, 2, 3], kappa=[1.0, 2.0])


def test_what_is_missing_is_told_in_a_short_line():
    data = xr.Dataset({f"v{i}": 0 for i in range(10)})
    with refusal("missing", "variable 'time'", value="only v0, v1, v2, v3, v4, v5, v6, v7 and 2 more"):
        require(data, "time")


def test_what_is_required_must_be_there_in_its_unit():
    data = dataset(time=[0.0, 1.0], excursion=[0.0, 0.1])
    require(data, "time", "excursion")
    with refusal("missing", "variable 'kappa'"):
        require(data, "excursion", "kappa")
    with refusal("shape", "variable 'excursion'"):
        require(data.isel(time=0), "excursion")
    data.excursion.attrs["units"] = "mm"
    with refusal("unknown", "variable 'excursion'", value="'mm'"):
        require(data, "excursion")


def test_refusals_are_one_line():
    with refusal("missing", "variable 'kappa'") as failure:
        require(dataset(contact=0.1), "kappa")
    assert "\n" not in str(failure.value)


def test_every_name_stands_in_one_table_only():
    modules = [
        import_module(f"vibrissa.quantities.{found.name}") for found in pkgutil.iter_modules(quantities.__path__)
    ]
    tables = [getattr(module, module.__name__.rpartition(".")[2].upper(), {}) for module in modules]
    assert sum(map(len, tables)) == len(QUANTITIES)
