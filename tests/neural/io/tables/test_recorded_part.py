"""What a table of trials does not hold is not silence: it is refused where it would be counted."""

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

import vibrissa as vb
from vibrissa.study.neurons.neurons import analyse_neurons
from vibrissa.study.spec.neurons import Neurons

TRIALS, LENGTH, RATE = 12, 4.0, 500.0
ONSETS = 10.0 + 8 * np.arange(TRIALS)
TIME = np.arange(int(LENGTH * RATE)) / RATE
MOTION = 40e-6 * (1 + 0.8 * np.sin(2 * np.pi * 1.3 * TIME)) * np.sin(2 * np.pi * 65 * TIME)
SHOWN = xr.DataArray(MOTION, {"time": TIME}, ["time"], attrs={"units": "m"})
SPIKES = {"u": np.sort(np.random.default_rng(1).uniform(8, ONSETS[-1] + 6, 4000))}  # everywhere alike
PAIRS = np.stack([ONSETS, ONSETS + LENGTH], 1)


def cut(start, stop):
    return vb.read_spikes(SPIKES, trials=PAIRS, window=(start, stop))


def counted(start, stop):
    """Rate by hand [Hz]."""
    since = SPIKES["u"][:, None] - ONSETS
    return ((since >= start) & (since < stop)).sum() / (TRIALS * (stop - start))


@pytest.mark.parametrize(
    ("held", "how", "quantity"),
    [
        ((-0.2, 4.0), {"spontaneous": (-1.0, 0.0)}, "spontaneous"),
        ((0.0, 4.0), {"spontaneous": (4.0, 5.0)}, "spontaneous"),
        ((2.0, 4.0), {}, "what is analysed"),
        ((0.0, 3.0), {}, "what is analysed"),
        ((1.0, 4.0), {"skip": 0.5}, "what is analysed"),
        ((1.5, 3.5), {"window": (1.0, 3.5), "skip": 0.0}, "what is analysed"),
    ],
)
def test_what_the_table_does_not_hold_is_refused(held, how, quantity):
    with refusal("range", quantity) as caught:
        vb.envelope_coupling(cut(*held), SHOWN, **how)
    window = tuple(map(float, caught.value.remedy.partition("window=(")[2].rstrip(")").split(",")))
    more = vb.envelope_coupling(cut(*window), SHOWN, **how)  # the remedy serves
    if "spontaneous" in how:
        assert more.spontaneous_rate.item() == pytest.approx(counted(*how["spontaneous"]), rel=1e-9)


def test_spikes_that_begin_after_what_is_skipped_are_enough():
    found = vb.envelope_coupling(cut(1.0, 4.0), SHOWN, skip=1.0)
    assert found.unit_rate.item() == pytest.approx(counted(1, 4), rel=1e-9)


def test_a_study_of_a_table_in_a_file_is_refused_too(tmp_path):
    vb.save(cut(-0.2, 4.0), tmp_path / "spikes.nc")
    np.savetxt(tmp_path / "m.csv", np.c_[TIME, MOTION], delimiter=",", header="time,displacement", comments="")
    with refusal("range", "spontaneous", "-1 to 0 s"):
        analyse_neurons(Neurons(spikes="spikes.nc", stimulus="m.csv", spontaneous=(-1.0, 0.0)), tmp_path)


@pytest.mark.parametrize("window", [(-1.0, 4.0), (0.0, 6.0)])
def test_units_are_judged_within_what_the_table_holds(window):
    for held in (vb.read_spikes(SPIKES, trials=PAIRS), cut(0.0, 4.0)):
        with refusal("range", "window", f"{window[0]:g} to {window[1]:g} s"):
            vb.unit_quality(held, window=window)
    assert vb.unit_quality(cut(*window)).unit_rate.item() == pytest.approx(counted(*window), rel=1e-9)
    assert vb.unit_quality(cut(-1, 6), window=window).unit_rate.item() == pytest.approx(counted(*window), rel=1e-9)


def test_trials_of_their_own_stimuli_are_refused_as_others(tmp_path):
    rows = [
        f"{k},{t - 0.5:.4f},{x:.9g}" for k in range(TRIALS) for t, x in zip(TIME, (k % 2 + 1) * MOTION, strict=True)
    ]
    (tmp_path / "own.csv").write_text("\n".join(["trial,time,displacement", *rows]))
    with refusal("range", "what is analysed", "-0.5 to 3.5 s"):
        vb.envelope_coupling(cut(0.0, 3.5), tmp_path / "own.csv", skip=0.0)
    found = vb.envelope_coupling(cut(0.0, 3.5), tmp_path / "own.csv", skip=0.5)
    assert found.unit_rate.item() == pytest.approx(counted(0.0, 3.5), rel=1e-9)


def test_spikes_before_the_onset_show_that_they_were_taken_there():
    """A table of which the window is not known any more."""
    spikes = cut(-1.0, 4.0)
    for name in ("window_start", "window_stop"):
        del spikes.attrs[name]
    found = vb.envelope_coupling(spikes, SHOWN, spontaneous=(-0.9, 0.0))
    assert found.spontaneous_rate.item() == pytest.approx(counted(-0.9, 0.0), rel=1e-9)
