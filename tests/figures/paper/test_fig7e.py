"""Figure 7E: the gain rises with the base angle; its rise with falling ε belongs to the linear response alone."""

import io

import numpy as np
import pytest

from vibrissa.figures.paper import fig7e
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.sweep.maps import REASONS
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05)


@pytest.fixture(scope="module")
def data():
    return fig7e.compute(WHISKER, contacts=[0.1, 0.12, 0.15, 0.2, 0.29, 0.4], base_angles=[0.8, 1.0, 1.2, 1.35, 1.4])


def test_gain_rises_with_the_base_angle_in_both_forms(data):
    steps = data.peak_displacement.diff("base_angle").values
    assert np.all(steps[~np.isnan(steps)] > 0)


def test_the_exact_response_is_the_smaller_and_the_more_so_at_large_angles_and_small_contacts(data):
    ratio = data.exact_over_linear
    assert float(ratio.max()) < 1
    for axis, sign in (("base_angle", -1), ("contact", 1)):
        steps = sign * ratio.diff(axis).values
        assert np.all(steps[~np.isnan(steps)] > 0)


def test_rise_with_falling_contact_is_in_the_linear_form_alone(data):
    steep = data.peak_displacement.sel(base_angle=1.4)[:, 0, 0]
    rise = (steep.sel(contact=0.15) / steep.sel(contact=0.29)).sel(form=["linear", "exact"])
    assert rise[0] > 1.5
    assert rise[1] < 0.7
    flat = data.peak_displacement.sel(base_angle=0.8)[:, 0, 0]
    assert np.all(flat.sel(contact=0.15) < flat.sel(contact=0.29))


def test_gain_over_the_paper_s_angles_beside_predictions_one_by_one(data):
    gap, t = Gaps(position=np.zeros(1), width=np.array([1e-3])), np.linspace(0, 0.03, 6001)
    for form in ("linear", "exact"):
        peak = []
        for angle in (0.8, 1.4):
            scan = Scan(speed=0.1, damping=0.11, response=form)
            one = predict(WHISKER, Posture(contact=0.2, base_angle=angle), gap, scan)
            peak.append(np.abs(one.displacement(t, np.array([0.9]))).max())
        found = data.peak_displacement.sel(form=form, contact=0.2, base_angle=[0.8, 1.4]).values.ravel()
        np.testing.assert_allclose(found, peak, rtol=1e-4)


def test_the_fold_is_grey(data):
    words = np.array(REASONS)[data.cell_reason.sel(form="exact", contact=0.1).values[0]]
    assert words[-1] == "beyond the fold"  # 1.378 rad
    assert words[0] == "ok"
    np.testing.assert_array_equal(np.isnan(data.peak_displacement.values), data.cell_reason.values[:, :, None] != 0)


def test_caption_tells_what_was_computed(data):
    linear = data.peak_displacement.sel(form="linear", contact=0.4)
    factor = float((linear.sel(base_angle=1.4) / linear.sel(base_angle=0.8)).squeeze())
    assert f"| {factor:.1f} (linear)" in data.attrs["caption"]


def test_draws(data):
    file = io.BytesIO()
    fig7e.draw(data).savefig(file, format="png")
    assert file.tell() > 20000
