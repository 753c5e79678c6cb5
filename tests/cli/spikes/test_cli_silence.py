"""A recording that ends before what is analysed: counts are refused, spike times are remarked on."""

import numpy as np
import pytest
from refusals import refusal

import vibrissa as vb
from vibrissa.api.remarks import Remark
from vibrissa.neural.coding.information import unit_information
from vibrissa.neural.io.formats.binned import read_binned

TRIALS, LENGTH = 12, 4.0
VERBS = {
    "neural": ("--skip", "0.5s"),
    "glm": ("--skip", "0.5s", "--bin-width", "10ms", "--reach", "60ms"),
    "surround": ("--skip", "0.5s"),
    "demodulation": ("--skip", "0.5s", "--bin-width", "10ms"),
    "drives": (),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two channels of 4 s, and two units of which the recording ends at 3 s."""
    here, rng = tmp_path_factory.mktemp("silence"), np.random.default_rng(0)
    time = np.arange(8000) / 2000
    slow = 1 + 0.5 * np.sin(2 * np.pi * 0.7 * time)
    one = 5e-5 * slow * np.sin(2 * np.pi * 12 * time)
    for name, columns in (("one", [one]), ("two", [one, one[::-1]])):
        header = ",".join(["time", *["C1", "C2"][: len(columns)]])
        np.savetxt(here / f"{name}.csv", np.c_[time, *columns], delimiter=",", header=header, comments="")
    counts = rng.poisson(0.3, (300, TRIALS, 2))
    np.save(here / "counts.npy", counts)
    rows = [f"u{u},{k},{0.01 * (b + (j + 0.5) / n):.6f}" for (b, k, u), n in np.ndenumerate(counts) for j in range(n)]
    (here / "spikes.csv").write_text("\n".join(["unit,trial,spike_time", *rows]))
    (here / "textures.csv").write_text("trial,texture\n" + "\n".join(f"{k},{'ab'[k % 2]}" for k in range(TRIALS)))
    return here


def words(verb, folder, *spikes):
    option = "--command" if verb in ("glm", "surround") else "--stimulus"
    shown = folder / ("two.csv" if verb in ("glm", "surround") else "one.csv")
    return (verb, *spikes, option, shown, *VERBS[verb])


@pytest.mark.parametrize("verb", VERBS)
def test_counts_that_end_before_the_stimulus_are_refused(vibrissa, folder, verb):
    counts = ("--spikes", folder / "counts.npy", "--counted-bin", "10ms")
    code, out, err = vibrissa(*words(verb, folder, *counts))
    assert (code, out, err.count("\n")) == (2, "", 1)
    rule = "counts must last to the end of what is analysed, 4 s, got 300 bins of 0.01 s; they end at 3 s: "
    assert rule + "give the right --counted-bin, or end" in err
    if verb != "drives":
        assert vibrissa(*words(verb, folder, *counts), "--window", 0, 3)[0] == 0


def test_a_wrong_width_of_the_counts_is_refused(vibrissa, folder):
    counts = ("--spikes", folder / "counts.npy", "--counted-bin", "5ms")
    code, _, err = vibrissa(*words("neural", folder, *counts), "--window", 0, 3)
    assert code == 2
    assert "counts are bins x trials x units; they end at 1.5 s: give the right --counted-bin" not in err
    assert "they end at 1.5 s: give the right --counted-bin" in err


@pytest.mark.parametrize("verb", VERBS)
def test_spikes_that_end_before_the_stimulus_are_remarked_on(vibrissa, folder, verb):
    asked = words(verb, folder, "--spikes", folder / "spikes.csv", "--trials", TRIALS)
    code, _, err = vibrissa(*asked)
    assert code == 0, err
    assert "no unit fires from 2.99" in err
    assert "to the end of the window, 4 s" in err
    if verb != "drives":
        assert "no unit fires" not in vibrissa(*asked, "--window", 0, 3)[2]


def test_windows_of_textures_and_bits_end_with_the_recording(vibrissa, folder):
    decode = ("discriminate", "--textures", folder / "textures.csv", "--permutations", 80, "--bin-width", "100ms")
    assert "no unit fires from 2.99" in vibrissa(*decode, "--spikes", folder / "spikes.csv", "--window", 0, 6)[2]
    assert "no unit fires" not in vibrissa(*decode, "--spikes", folder / "spikes.csv", "--window", 0, 3)[2]
    counts = ("--spikes", folder / "counts.npy", "--counted-bin", "10ms")
    for verb in (decode, ("information",)):
        assert "they end at 3 s" in vibrissa(*verb, *counts, "--window", 0, 4)[2]
        assert vibrissa(*verb, *counts, "--window", 0, 3)[0] == 0


def test_the_same_holds_in_python(folder):
    counts = read_binned(folder / "counts.npy", 0.01)
    with refusal("shape", "counts", "300 bins of 0.01 s"):
        vb.envelope_coupling(counts, folder / "one.csv", skip=0.5)
    with refusal("shape", "counts", "300 bins of 0.01 s"):
        unit_information(counts, TRIALS, window=(0.0, 4.0))
    spikes = vb.read_spikes(folder / "spikes.csv")
    with pytest.warns(Remark, match="No unit fires from 2.99"):
        vb.envelope_coupling(spikes, folder / "one.csv", n_trials=TRIALS, skip=0.5)


def test_printed_maps_name_the_whiskers(vibrissa, folder):
    spikes = ("--spikes", folder / "spikes.csv", "--trials", TRIALS)
    columns = {"surround": ("driving whiskers", "suppressing whiskers"), "glm": ("whiskers that matter",)}
    for verb, wanted in columns.items():
        out = vibrissa(*words(verb, folder, *spikes), "--window", 0, 3)[1].replace("_", " ")
        assert all(one in out for one in wanted), out


@pytest.mark.parametrize("verb", [*VERBS, "information", "discriminate"])
def test_trials_that_were_lost_among_others_are_remarked_on_by_every_verb(vibrissa, folder, tmp_path, verb):
    rng = np.random.default_rng(2)
    kept = [k for k in range(TRIALS) if k not in (3, 4, 5, 8)]
    rows = [f"u{u},{k},{t:.5f}" for u in range(2) for k in kept for t in rng.uniform(0, LENGTH, 40)]
    (tmp_path / "spikes.csv").write_text("\n".join(["unit,trial,spike_time", *rows]))
    spikes = ("--spikes", tmp_path / "spikes.csv", "--trials", TRIALS)
    if verb == "information":
        called = (verb, *spikes, "--window", 0, 3.9)
    elif verb == "discriminate":
        called = (verb, spikes[1], "--textures", folder / "textures.csv", "--window", 0, 3.9, "--bin-width", "100ms")
    else:
        called = words(verb, folder, *spikes)
    _, _, err = vibrissa(*called)
    assert "trials 3 to 5 and 8 hold no spike of any unit: were they presented?" in err
