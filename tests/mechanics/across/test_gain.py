"""Effects over sweeps with a known law, and correlograms of envelopes with a known offset."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.mechanics.across.gain import distance_correlogram, effects


def test_offset_of_envelopes_at_two_speeds_is_found():
    def land(x):
        return np.exp(-(((x - 20e-3) / 2e-3) ** 2)) + 0.5 * np.sin(2 * np.pi * x / 9e-3)

    t = np.arange(600) / 1000
    late = 1.4e-3
    offset, rho = distance_correlogram((land(0.1 * t - late), t, 0.1), (land(0.15 * t), t, 0.15), 3e-3)
    assert offset[rho.argmax()] == pytest.approx(late, abs=3e-5)
    assert rho.max() > 0.999


def test_sweeps_that_share_too_little_are_refused():
    t = np.arange(600) / 1000
    with refusal("too-few", "sweeps"):
        distance_correlogram((t, t, 0.1), (t, t, 0.15), 40e-3)


def test_slope_put_in_comes_out_and_a_dead_term_does_not():
    rng = np.random.default_rng(1)
    clusters = np.repeat(np.arange(12), 20)
    angle, contact = rng.uniform(0.8, 1.4, 240), rng.uniform(0.1, 0.4, 240)
    y = 2 + 3 * angle + 0.3 * rng.standard_normal(240)
    told = effects(y, {"base_angle": angle, "contact": contact}, clusters)
    expected = 3 * angle.std() / y.mean()
    assert float(told.effect_low[0]) < expected < float(told.effect_high[0])
    assert float(told.effect_p_clustered[0]) < 1e-6
    assert float(told.effect_p_clustered[1]) > 0.01


def test_term_of_the_whisker_alone_is_found_by_sweeps_far_too_often_and_by_whiskers_rarely():
    """400 null cases: the rms differs between 8 whiskers, and so does a term that has no effect."""
    rng = np.random.default_rng(2)
    clusters = np.repeat(np.arange(8), 10)
    p = []
    for _ in range(400):
        y = 3 + rng.standard_normal(8)[clusters] + 0.5 * rng.standard_normal(80)
        term = rng.standard_normal(8)[clusters] + 0.1 * rng.standard_normal(80)
        told = effects(y, {"term": term}, clusters)
        p.append((float(told.effect_p[0]), float(told.effect_p_clustered[0])))
    naive, clustered = (np.array(p) < 0.05).mean(axis=0)
    assert naive > 0.3
    assert clustered < 0.09


def test_what_the_data_cannot_tell_is_nan():
    told = effects(np.ones(3), {"contact": np.full(3, 0.2)}, np.arange(3))
    assert np.isnan(told.effect_p[0])


def test_no_terms_have_no_effects():
    assert effects(np.arange(3.0), {}, ["a", "b", "c"]).sizes == {"term": 0}
