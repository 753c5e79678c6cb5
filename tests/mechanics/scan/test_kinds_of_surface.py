"""A prediction that is given a surface of another kind says in one line which function takes it."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.mechanics.across.comparison import predicted_envelopes
from vibrissa.mechanics.contact.gap_events import trough_events
from vibrissa.mechanics.scan.relief_prediction import predict_relief
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict, predict_all
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.whisking.active_whisking import predict_slow
from vibrissa.mechanics.whisking.posture_path import PosturePath
from vibrissa.sweep.grid import Grid, Measure
from vibrissa.sweep.maps import sweep
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import periodic_grating
from vibrissa.whisker import Whisker

HELD = Whisker(length=0.04, cone_angle=1.5e-3), Posture(contact=0.29, base_angle=1.2)
SCAN = Scan(speed=0.1, damping=0.11)
GAPS = periodic_grating(0.01, period=1e-3)
RELIEF = HeightProfile.from_gaps(GAPS)
PATH = PosturePath(time=np.linspace(0, 0.1, 5), contact=np.full(5, 0.29), base_angle=np.full(5, 1.2))
GRID = Grid(contact=np.array([0.29]), base_angle=np.array([1.2]), speed=np.array([0.1]))


@pytest.mark.parametrize(
    ("call", "instead"),
    [
        (lambda: predict(*HELD, RELIEF, SCAN), "predict_relief"),
        (lambda: predict_all(*HELD, [GAPS, RELIEF], SCAN), "predict_relief"),
        (lambda: predicted_envelopes(*HELD, SCAN, [RELIEF], np.arange(9) / 100), "predict_relief"),
        (lambda: trough_events(RELIEF, *HELD, 0.1), "vibrissa.mechanics.contact.episodes.episodes"),
        (lambda: predict_slow(HELD[0], PATH, RELIEF, SCAN), "predict_relief"),
        (lambda: sweep(HELD[0], RELIEF, GRID, Measure()), "predict_relief"),
        (lambda: predict_relief(*HELD, GAPS, SCAN), "vibrissa.mechanics.scan.texture_prediction.predict"),
    ],
)
def test_the_line_names_the_function_that_takes_the_surface(call, instead):
    with refusal("format") as told:
        call()
    assert instead in str(told.value)
    assert "\n" not in str(told.value)
