"""A study's base signal against its prediction: which damping the model has, and what is said of the record."""

import json

import numpy as np
import pytest
from refusals import refusal

from vibrissa.mechanics.scan.follicle import follicle_signals
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture, stationary_profile
from vibrissa.study.forward.base_signals import analyse_signal
from vibrissa.study.spec.base_signal import BaseSignal
from vibrissa.texture.io import write_gaps
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import DAMPING, Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
POSTURE = Posture(contact=0.29, base_angle=1.2)
TIME = np.arange(6000) / 4000
LIGHT = 0.03  # damping ratio, far from the default


def written(folder, moment):
    rows = "".join(f"{t:.6f},{v:.8g}\n" for t, v in zip(TIME, moment, strict=True))
    (folder / "moment.csv").write_text("time,moment\n" + rows)


def entry(**values):
    known = {"path": "moment.csv", "kind": "moment", "unit": "N m", "whisker": WHISKER, "modes": 1, "gratings": 0}
    return BaseSignal(**known | {"posture": POSTURE, "texture": "plate.csv", "scan_speed": 0.1} | values)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The moment of a lightly damped whisker on a known plate."""
    folder = tmp_path_factory.mktemp("robot")
    texture = random_grating(0.16, rng=np.random.default_rng(1))
    write_gaps(texture, folder / "plate.csv")
    truth = predict(WHISKER, POSTURE, texture, Scan(speed=0.1, damping=LIGHT), n_modes=5)
    written(folder, follicle_signals(truth, TIME)["base_moment"])
    return folder


def test_the_prediction_has_the_damping_that_was_fitted(folder):
    found = analyse_signal(entry(), folder)
    assert found.attrs["model_damping"] == pytest.approx(LIGHT, rel=0.05)
    assert found.attrs["model_damping_note"].endswith("as fitted to mode 1")
    assert float(found.correlation[0]) > 0.999
    assert float(found.rms_ratio[0]) == pytest.approx(1, abs=0.02)
    assert float(found.best_lag[0]) == 0


def test_a_damping_that_is_given_is_taken(folder):
    found = analyse_signal(entry(damping=DAMPING), folder)
    assert found.attrs["model_damping"] == DAMPING
    assert found.attrs["model_damping_note"] == "the prediction has a damping ratio of 0.11, as given"
    assert float(found.rms_ratio[0]) < 0.7  # a heavily damped whisker rings less


def test_where_no_resonance_is_found_the_default_is_taken_and_said(folder, tmp_path):
    (tmp_path / "plate.csv").write_bytes((folder / "plate.csv").read_bytes())
    written(tmp_path, 1e-9 * np.cumsum(np.random.default_rng(0).normal(size=len(TIME))))
    found = analyse_signal(entry(), tmp_path)
    assert np.isnan(found.damping[0])
    assert found.attrs["model_damping"] == DAMPING
    assert "the default, as mode 1 was not identified" in found.attrs["model_damping_note"]


def test_a_damping_without_a_texture_is_refused():
    with refusal("conflict", "base signal with a damping"):
        entry(texture=None, damping=0.05)


def test_the_command_says_how_many_samples_are_clipped(vibrissa, tmp_path):
    ringing = np.sin(2 * np.pi * 120 * TIME) * (1 + 0.1 * np.sin(2 * np.pi * TIME))
    words = ("--kind", "moment", "--signal-unit", "N m", "--guess", "120")
    for top, said in ((2.0, False), (0.8, True)):
        written(tmp_path, 1e-6 * np.clip(ringing, -top, top))
        code, _, err = vibrissa("sensor", tmp_path / "moment.csv", *words)
        assert code == 0, err
        count = np.count_nonzero(np.abs(ringing) >= 0.8)
        assert (f"{count} samples lie at the ends of the range, perhaps clipped" in err) == said


def test_the_command_says_how_many_samples_were_held(vibrissa, tmp_path):
    ringing = np.sin(2 * np.pi * 120 * TIME) * (1 + 0.1 * np.sin(2 * np.pi * TIME))
    words = ("--kind", "moment", "--signal-unit", "N m", "--guess", "120")
    for held in (False, True):
        for at in range(100, 1000, 100) if held else ():
            ringing[at : at + 37] = ringing[at - 1]
        written(tmp_path, 1e-6 * ringing)
        code, _, err = vibrissa("sensor", tmp_path / "moment.csv", *words)
        assert code == 0, err
        assert ("samples repeat the one before" in err) == held


def test_the_height_of_the_base_is_as_good_as_the_contact(vibrissa, folder):
    height = WHISKER.length * float(stationary_profile(POSTURE).base_distance)
    words = ("--kind", "moment", "--signal-unit", "N m", "--texture", folder / "plate.csv", "--speed", "0.1")
    cone = ("--whisker.length", "0.04", "--whisker.cone-angle", "1.5e-3", "--n-modes", "1", "--gratings", "0")
    code, out, err = vibrissa(
        "sensor", folder / "moment.csv", *words, *cone, "--base-distance", f"{height}m", "--base-angle", "1.2", "--json"
    )
    assert code == 0, err
    assert json.loads(out)["correlation"][0] > 0.999
    code, _, err = vibrissa("sensor", folder / "moment.csv", *words, *cone, "--base-distance", "0.4")
    assert code == 2
    assert "--base-angle" in err
