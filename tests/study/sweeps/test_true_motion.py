"""The truth of a virtual sweep: a rod to its physical tip, or the single-contact model."""

import dataclasses

import numpy as np
import pytest

from vibrissa.errors import ConvergenceError
from vibrissa.exact import cone_modes
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.study.spec.laboratory import Laboratory
from vibrissa.study.sweeps import truth
from vibrissa.study.sweeps.laboratory import plan
from vibrissa.study.sweeps.truth import ModalMotion, true_motion
from vibrissa.study.sweeps.virtual_sweep import film_of, filmed_sweep, virtual_sweep

LABORATORY = Laboratory(animals=1, whiskers=("C1",), conditions=1, textures=1, n_frames=500, speeds=(0.15,), seed=3)


@pytest.fixture(scope="module")
def sweep():
    return plan(LABORATORY)[0][0]


@pytest.fixture(scope="module")
def predicted(sweep):
    return predict(sweep.whisker, sweep.posture, LABORATORY.grating(0), sweep.scan)


@pytest.fixture(scope="module")
def film(predicted):
    return film_of(predicted, LABORATORY, np.random.default_rng(0))


@pytest.fixture(scope="module")
def rod(predicted, film):
    return true_motion(predicted, "rod", film)


def test_the_rod_is_the_default_and_the_modes_are_the_prediction_itself(predicted, film):
    assert LABORATORY.truth == "rod"
    motion, t, s = true_motion(predicted, "modes", film), np.linspace(0, 0.05, 20), np.linspace(0.3, 1, 9)
    assert isinstance(motion, ModalMotion)
    np.testing.assert_array_equal(motion.position(t, s), predicted.position(t, s))
    np.testing.assert_array_equal(motion.mode_displacement(t), predicted.mode_displacement(t))
    np.testing.assert_array_equal(motion.resonances, predicted.omega / (2 * np.pi))


def test_the_rod_rests_where_eq_1_has_it_and_its_base_is_held(rod, predicted):
    """Before the texture: along the profile of the flat, whose contact slides by less than 0.01 L on a whole shaft."""
    s = np.linspace(predicted.posture.contact, 1, 200)
    x, y = rod.position(np.array([-0.004, -0.003]), s)
    along, up = predicted.response.flat.position(s)
    assert np.abs(x[0] - along).max() < 0.004
    assert np.abs(y[0] - up).max() < 0.004
    np.testing.assert_allclose([x[:, -1], y[:, -1]], 0, atol=1e-9)


def test_the_shaft_does_not_stretch_and_goes_on_straight_in_the_follicle(rod):
    s, t = np.linspace(0.1, 1.05, 400), np.linspace(0.01, 0.24, 40)
    x, y = rod.position(t, s)
    lengths = np.hypot(np.diff(x), np.diff(y)) / np.diff(s)
    np.testing.assert_allclose(lengths, 1, atol=2e-3)
    inside = s > 1
    directions = np.arctan2(np.diff(y[:, inside]), np.diff(x[:, inside]))
    np.testing.assert_allclose(directions, directions[:, :1] + np.zeros_like(directions), atol=1e-9)


def test_its_modes_are_what_its_positions_show(rod, predicted):
    """Least squares of the motion across the resting shaft, of the same three modes, on other points."""
    edges = np.linspace(predicted.posture.contact + 0.02, 1, 700)
    s = (edges[1:] + edges[:-1]) / 2
    t = np.arange(0.01, 0.24, 5e-4)
    rest = np.stack(rod.position(np.array([-0.004]), s))[:, 0]
    angle = np.arctan2(*np.gradient(rest, s, axis=1)[::-1])
    moved = np.stack(rod.position(t, s)) - rest[:, None]
    across = np.cos(angle) * moved[1] - np.sin(angle) * moved[0]
    shapes = cone_modes(predicted.kappa[:3], predicted.posture.contact, s) * s
    found = np.linalg.lstsq(shapes.T, (across * s).T, rcond=None)[0]
    shown = rod.mode_displacement(t)
    sign = np.sign((found * shown).sum(axis=1))
    np.testing.assert_array_equal(sign, sign[0])  # angles are counted from tip to base
    np.testing.assert_allclose(sign[:, None] * found, shown, atol=0.02 * shown[0].std())


def test_between_its_records_the_motion_is_that_of_a_finer_one(rod, predicted, film, monkeypatch):
    monkeypatch.setattr(truth, "_RATE", 40_000.0)
    finer, t = true_motion(predicted, "rod", film), np.linspace(0.02, 0.2, 3001)
    a, b = rod.mode_displacement(t), finer.mode_displacement(t)
    assert (np.abs(a - b).max(axis=1) < 0.02 * b.std(axis=1)).all()


def test_the_free_end_takes_most_of_the_motion_away_and_the_analysis_is_not_told(sweep):
    by_rod = filmed_sweep(LABORATORY, sweep)
    by_modes = filmed_sweep(dataclasses.replace(LABORATORY, truth="modes"), sweep)
    assert by_rod.known.whisker == by_modes.known.whisker
    for name in ("scan_speed", "base_height", "substrate", "friction", "exposure", "instants", "contact"):
        assert getattr(by_rod.known, name) == getattr(by_modes.known, name)
    t = np.arange(0, 0.24, 5e-4)
    free, pinned = (one.motion.mode_displacement(t)[0].std() for one in (by_rod, by_modes))
    assert free < 0.2 * pinned


def test_a_row_holds_the_truth_of_the_rod(sweep):
    row, series = virtual_sweep(LABORATORY, sweep)
    assert (row["mode_rms_true"] < 0.2 * row["mode_rms_model"]).all()
    assert row["youngs_modulus_true"] == LABORATORY.youngs_modulus
    assert row["contact_true"] == sweep.posture.contact
    np.testing.assert_allclose(series.mode_displacement_true.values.std(axis=1), row["mode_rms_true"])
    assert row["variance_explained_true"][0] > 0.8


def test_a_run_that_does_not_converge_is_made_with_half_the_step(predicted, film, monkeypatch):
    tried = []

    def fails_twice(prediction, duration, step):
        tried.append(step)
        if len(tried) < 3:
            raise ConvergenceError("motion of the rod", 1.0, 40)
        return "made"

    monkeypatch.setattr(truth, "_run", fails_twice)
    assert true_motion(predicted, "rod", film).run == "made"
    np.testing.assert_allclose(np.array(tried) / tried[0], [1, 1 / 2, 1 / 4])
    monkeypatch.setattr(truth, "_run", lambda *_: (_ for _ in ()).throw(ConvergenceError("motion of the rod", 1.0, 40)))
    with pytest.raises(ConvergenceError):
        true_motion(predicted, "rod", film)


def test_a_stiff_whisker_at_a_thin_contact_converges():
    """The built-in laboratory's fifth sweep: with the default step of 25 µs it does not."""
    laboratory = Laboratory(
        whiskers=("beta", "C1", "C2"), conditions=2, textures=1, n_frames=300, seed=3, base_angles=(0.8, 1.5)
    )
    one = plan(laboratory)[0][4]
    predicted = predict(one.whisker, one.posture, laboratory.grating(one.key[3]), one.scan)
    motion = true_motion(predicted, "rod", film_of(predicted, laboratory, np.random.default_rng(0)))
    assert np.abs(motion.mode_displacement(np.arange(0, 0.15, 5e-4))).max() < 0.01
