"""Figure 10: what its panels and its caption say of the recovery of resonance and damping."""

import numpy as np
import pytest
import xarray as xr
from refusals import refusal
from scipy.stats import kstest

from vibrissa.exact import cone_kappa
from vibrissa.figures.others import recovery

N, TIMESCALE = 400, 2e-3


def sweeps(*, bias=0.0, narrow=1.0, virtual=True):
    """Sweeps whose fits err by Gaussian noise of known standard error; those of white forcing also by a bias."""
    rng = np.random.default_rng(3)
    contact = rng.uniform(0.2, 0.5, N)
    true = np.array([cone_kappa(one, 3) for one in contact]) / (2 * np.pi * TIMESCALE)
    columns = {"contact": ("sweep", contact), "timescale": ("sweep", np.full(N, TIMESCALE))}
    columns["accepted"] = ("sweep", np.arange(N) % 10 > 0)
    for name, truth, error in (("resonant_frequency", true, 0.01 * true), ("damping", np.full_like(true, 0.11), 0.005)):
        for forcing, shift in (("", 0.0), ("_white", bias)):
            found = truth * (1 + shift) + error * rng.standard_normal(true.shape)
            for end, sign in (("", 0), ("_low", -1), ("_high", 1)):
                columns[f"{name}{forcing}{end}"] = ("sweep", "mode"), found + sign * 1.96 * narrow * error
        if virtual:
            columns[f"{name}_true"] = ("sweep", "mode"), truth
    return xr.Dataset(columns, {"sweep": np.arange(N), "mode": [1, 2, 3]})


@pytest.fixture(scope="module")
def data():
    return recovery.compute({"sweeps": sweeps(bias=-0.08)})


def test_sweeps_that_were_accepted_rise_with_the_contact(data):
    assert data.sizes["sweep"] == N - N // 10
    assert (np.diff(data.contact) > 0).all()


def test_errors_of_right_intervals_are_standard_normal(data):
    for name in ("frequency", "damping"):
        for mode in (1, 2):
            one = data.sel(forcing="texture known", mode=mode)
            assert kstest(one[f"{name}_z"], "norm").pvalue > 1e-3
            assert float(one[f"{name}_held"]) == pytest.approx(0.95, abs=0.035)


def test_a_bias_is_the_median_error_and_empties_the_intervals(data):
    one = data.sel(forcing="white, Eq. 5", mode=2)
    assert float(np.median(one.frequency_ratio)) == pytest.approx(0.92, abs=2e-3)
    assert float(one.frequency_held) < 0.01
    assert "White, Eq. 5: mode 1: median error −8." in data.attrs["caption"]


def test_intervals_of_half_the_width_hold_the_truth_in_two_thirds_of_the_sweeps():
    found = recovery.compute({"sweeps": sweeps(narrow=0.5)})
    np.testing.assert_allclose(found.frequency_held, 0.673, atol=0.08)  # 2 Φ(0.98) − 1
    np.testing.assert_allclose(found.frequency_z.std("sweep"), 2, rtol=0.12)


def test_without_a_truth_frequencies_are_over_those_of_the_model():
    found = recovery.compute({"sweeps": sweeps(virtual=False).isel(sweep=slice(0, N // 2))})
    ratio = found.frequency_ratio  # its own median would have Numba compile numbagg's, where that is installed
    np.testing.assert_allclose(np.nanmedian(ratio, axis=ratio.get_axis_num("sweep")), 1, atol=3e-3)
    assert np.isnan(found.frequency_z).all()
    assert np.isnan(found.damping_reference).all()
    assert "No truth is known" in found.attrs["caption"]


@pytest.mark.parametrize(("virtual", "panels"), [(True, 6), (False, 4)])
def test_drawing_has_a_column_of_errors_only_with_a_truth(virtual, panels):
    figure = recovery.draw(recovery.compute({"sweeps": sweeps(virtual=virtual)}))
    assert len(figure.axes) == panels
    assert [axis.get_title(loc="left")[0] for axis in figure.axes] == list("ABCDEF")[:panels]


def test_a_table_without_an_accepted_sweep_is_refused():
    with refusal("too-few", "sweeps") as refused:
        recovery.compute({"sweeps": sweeps().assign(accepted=("sweep", np.zeros(N, bool)))})
    assert refused.value.quantity == "sweeps"
