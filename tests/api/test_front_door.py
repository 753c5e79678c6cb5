"""The public names: loaded when they are used, documented, whose errors name the argument that was wrong."""

import inspect
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

import vibrissa as vb
from vibrissa.api.remarks import Remark

ROOT = Path(__file__).parents[2]
WHISKER, POSTURE = vb.Whisker(length=0.04, cone_angle=1.5e-3), vb.Posture(contact=0.29, base_angle=1.2)
SURFACE = vb.periodic_grating(0.02, period=2e-3)
FUNCTIONS = [name for name in vb.__all__ if inspect.isfunction(getattr(vb, name))]
HEAVY = ("numpy", "scipy", "xarray", "numba", "pandas", "matplotlib", "dask", "av", "h5py")


def test_importing_the_package_loads_nothing_heavy():
    said = "import sys, vibrissa; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", said], capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in done.stdout.split()}
    assert not loaded & set(HEAVY)
    assert [name for name in done.stdout.split() if name.startswith("vibrissa.")] == []


def test_a_touched_name_loads_its_own_room_alone():
    said = "import sys, vibrissa as vb; vb.Whisker; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", said], capture_output=True, text=True, check=True)
    assert {"matplotlib", "av", "dask"} & set(done.stdout.split()) == set()


def test_every_public_name_is_there_and_nothing_else_is_shown():
    assert sorted(set(dir(vb)) - {"__version__"}) == sorted(vb.__all__)
    for name in vb.__all__:
        assert getattr(vb, name).__name__ == name
    with pytest.raises(AttributeError, match="scann"):
        vb.scann  # noqa: B018


@pytest.mark.parametrize("name", vb.__all__)
def test_every_public_name_says_what_it_is(name):
    thing = getattr(vb, name)
    text = inspect.getdoc(thing)
    assert text.partition("\n")[0].endswith(".")
    if name in FUNCTIONS:
        assert set(inspect.signature(thing).parameters) <= set(text.replace(",", " ").replace("*", "").split())
        assert {"Parameters", "Returns"} - ({"Returns"} if name == "save" else set()) <= set(text.split("\n"))


def test_every_room_says_that_it_is_internal():
    contract = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"][0]
    rooms = [room.strip("() ") for row in contract["layers"] for room in row.split("|")]
    packages = [room for room in rooms if (ROOT / "src" / "vibrissa" / room / "__init__.py").is_file()]
    assert len(packages) > 12
    for room in set(packages) - {"api"}:
        text = (ROOT / "src" / "vibrissa" / room / "__init__.py").read_text(encoding="utf-8")
        assert "Internal: the public names are those of ``vibrissa`` itself." in text, room


def test_one_scan_takes_any_surface_and_a_posture_that_changes():
    heights = vb.HeightProfile.from_gaps(SURFACE)
    path = vb.PosturePath(time=[-0.05, 0.5], base_angle=[1.2, 1.21], contact=[0.29, 0.29])
    for posture, surface in ((POSTURE, SURFACE), (POSTURE, heights), (path, SURFACE)):
        motion = vb.scan(WHISKER, posture, surface, speed=0.1)
        data = motion.sample(2000)
        assert data.envelope.attrs["units"] == "m"
        assert data.envelope.dims == ("mode", "time")
        assert motion.whisker == WHISKER
        assert len(repr(motion)) < 140
    gaps, same = (vb.scan(WHISKER, POSTURE, one, speed=0.1).sample(2000) for one in (SURFACE, heights))
    begun = slice(0, 500)  # a height profile ends later than its last gap
    np.testing.assert_allclose(same.mode_displacement[:, begun], gaps.mode_displacement[:, begun], rtol=0, atol=1e-7)


def test_a_part_of_a_movie_is_tracked_alike_from_a_file_and_from_memory():
    from vibrissa.video.io.movie import read_blocks

    movie = vb.sample_data("movie.mkv")
    frames = np.concatenate(list(read_blocks(movie)))
    how = {"frame_rate": 2000.0, "pixel_size": 95e-6, "skin": [(50.5, 57)], "start": 100, "stop": 130}
    stored, held = vb.track(movie, **how), vb.track(frames, **how)
    np.testing.assert_array_equal(stored.x, held.x)
    np.testing.assert_allclose(held.time, np.arange(100, 130) / 2000)
    assert (held.attrs["first_frame"], held.attrs["last_frame"]) == (100, 129)
    titles = [axis.get_title(loc="left") for axis in vb.plot_tracks(held, frames, frames=[100, 129]).axes]
    assert titles == ["frame 100, 0.0500 s", "frame 129, 0.0645 s"]
    part = vb.plot_tracks(held.isel(time=slice(10, 20)), frames, frames=[110, 119])
    assert part.axes[0].get_title(loc="left") == "frame 110, 0.0550 s"
    np.testing.assert_array_equal(part.axes[0].images[0].get_array(), frames[110])
    strided = held.isel(time=slice(0, None, 10))
    for source in (frames, movie):
        shown = vb.plot_tracks(strided, source).axes
        assert [axis.get_title(loc="left").partition(",")[0] for axis in shown[:3]] == [
            f"frame {k}" for k in (100, 110, 120)
        ]
        for axis, k in zip(shown, (100, 110, 120), strict=False):
            np.testing.assert_array_equal(axis.images[0].get_array(), frames[k])
    with refusal("range", "frames", value="[105]"):
        vb.plot_tracks(strided, frames, frames=[110, 105])
    with refusal("range", "frames"):
        vb.plot_tracks(held, frames, frames=[99])
    with refusal("range", "start, stop"):
        vb.track(frames, **how | {"stop": 401})


def test_an_envelope_is_in_metres_whoever_made_it():
    motion = vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1)
    data = motion.sample(2000)
    own = vb.envelope(WHISKER.length * data.mode_displacement)
    np.testing.assert_allclose(own, data.envelope, rtol=1e-12, atol=1e-18)
    assert own.dims == data.envelope.dims


def test_a_gap_is_given_in_metres_and_agrees_with_the_adimensional_one():
    from vibrissa.mechanics.scan.gap_report import crossing

    found, known = vb.gap(WHISKER, POSTURE, width=0.6e-3), crossing(POSTURE, 0.015)
    np.testing.assert_allclose(found.linearity, known.linearity, rtol=1e-10)


MISTAKES = {
    "speed": lambda: vb.scan(WHISKER, POSTURE, SURFACE, speed=100),
    "damping": lambda: vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, damping=11),
    "response": lambda: vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, response="exakt"),
    "jump": lambda: vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, jump="none"),
    "modes": lambda: vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, modes="bent"),
    "Whisker.length": lambda: vb.Whisker(length=40, cone_angle=1.5e-3),
    "Posture.base_angle": lambda: vb.Posture(contact=0.29, base_angle=70),
    "Posture.contact": lambda: vb.Posture(contact=11.6, base_angle=1.2),
    "whisker": lambda: vb.atlas("C22x"),
    "name": lambda: vb.sample_data("gratng.csv"),
    "posture": lambda: vb.modes(WHISKER, about="profile"),
    "rate": lambda: vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1).sample(-1),
    "nodes": lambda: vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1).sample(2000, nodes=[5.0]),
    "signal": lambda: vb.envelope(np.zeros(2)),
    "frame_rate": lambda: vb.track(np.zeros((3, 40, 60), np.uint8), pixel_size=1e-4, seeds=[(30, 20)]),
    "pixel_size": lambda: vb.track(np.zeros((3, 40, 60), np.uint8), frame_rate=2000, pixel_size=95, seeds=[(30, 20)]),
    "duration": lambda: vb.replay(vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1), duration=-1),
    "n_trials": lambda: vb.simulate_units(vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1), 3, n_trials=0),
    "units": lambda: vb.simulate_units(vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1), 0),
    "base_angle": lambda: vb.Posture(contact=0.29, angle=1.2),
}


@pytest.mark.parametrize("argument", [name for name in MISTAKES if name != "base_angle"])
def test_a_plausible_mistake_is_one_line_that_names_the_argument(argument):
    with pytest.raises(vb.InputError) as caught:
        MISTAKES[argument]()
    assert caught.value.quantity == argument
    assert "\n" not in str(caught.value)


IN_SI = {
    "np.deg2rad(70) = 1.2217": lambda: vb.Posture(contact=0.29, base_angle=70),
    "0.0116 / whisker.length for 11.6 mm": lambda: vb.Posture(contact=11.6, base_angle=1.2),
    "0.29 for 0.0116 m": lambda: vb.profile(
        vb.Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05), vb.Posture(contact=0.0116, base_angle=1.2)
    ),
    "0.1 for 100 mm/s": lambda: vb.scan(WHISKER, POSTURE, SURFACE, speed=100),
    "0.11 for 11 %": lambda: vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, damping=11),
    "0.04 for 40 mm": lambda: vb.Whisker(length=40, cone_angle=1.5e-3),
    "0.0015 for 1.5 mrad": lambda: vb.Whisker(length=0.04, cone_angle=1.5),
    "3.74e+09 for 3.74 GPa": lambda: vb.Whisker(length=0.04, cone_angle=1.5e-3, youngs_modulus=3.74),
    "1140 for 1.14 g/cm³": lambda: vb.Whisker(length=0.04, cone_angle=1.5e-3, density=1.14),
    "0.002 / whisker.length for 2 mm": lambda: vb.Whisker(length=0.04, cone_angle=1.5e-3, tip=2),
    "0.0006 for 0.6 mm": lambda: vb.gap(WHISKER, POSTURE, width=0.6),
    "3.5e-05 for 35 µm": lambda: vb.gap(WHISKER, POSTURE, width=0.6e-3, depth=35),
    "0.019 for 19 mm": lambda: vb.profile(WHISKER, POSTURE, distance=19),
    "0.005 for 5 mm": lambda: vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1).sample(2000, nodes=[5.0]),
    "9.5e-05 for 95 µm": lambda: vb.track(
        np.zeros((3, 40, 60), np.uint8), frame_rate=2000, pixel_size=95, seeds=[(30, 20)]
    ),
    "5e-07 for 0.5 µm, 0.0005 for 0.5 mm": lambda: vb.track(
        np.zeros((3, 40, 60), np.uint8), frame_rate=2000, pixel_size=0.5, seeds=[(30, 20)]
    ),
    "5.5e-05 for 55 µm": lambda: vb.simulate_units(vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1), 3, mean_envelope=55),
    "0.036 for 36 mm": lambda: vb.fit_cone(vb.sample_data("diameters.csv"), physical_length=36),
    "0.01 for 10 ms": lambda: vb.envelope_coupling(
        vb.sample_data("spikes.csv"), vb.sample_data("spikes-stimulus.csv"), bin_width=10
    ),
}


@pytest.mark.parametrize("meant", IN_SI)
def test_a_number_in_another_unit_is_answered_with_its_value_in_si(meant):
    with pytest.raises(vb.InputError) as caught:
        IN_SI[meant]()
    assert meant in caught.value.remedy


def test_results_are_a_mapping_that_reads_what_is_asked_for(tmp_path):
    with refusal("missing", str(tmp_path)):
        vb.open_results(tmp_path)
    vb.save(vb.modes(WHISKER, POSTURE), tmp_path / "modes.nc")
    results = vb.open_results(tmp_path)
    assert list(results) == ["modes"]
    assert "modes" in results
    assert "gap" not in results
    assert results["modes"].sizes["mode"] == 3
    assert "modes" in repr(results)
    with pytest.raises(KeyError, match="did you mean modes"):
        results["mods"]


def test_what_a_reader_should_know_is_a_remark():
    motion = vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1)
    assert motion.verdict.split()[0] in ("usable:", "caution:", "outside")
    assert motion.verdict.split()[0] in repr(motion)
    with pytest.warns(Remark, match="^Modes 3 and above ring too fast .*\\.$"):
        motion.sample(1300)


@pytest.mark.parametrize("response", ["exact", "linear"])
def test_remarks_are_sentences(response):
    for surface in (SURFACE, vb.HeightProfile.from_gaps(SURFACE)):
        motion = vb.scan(WHISKER, POSTURE, surface, speed=0.1, response=response)
        first, *others = motion.remarks(4000)
        assert first.startswith(("The prediction is ", "The prediction needs caution: "))
        assert len(others) > 2
        for line in others:
            assert re.fullmatch(r"[A-Z0-9].*\b(is|are|prevents|bridges|jumps|would|never)\b.*\.", line), line
    path = vb.PosturePath(time=[-0.05, 0.5], base_angle=[1.2, 1.21], contact=[0.29, 0.29])
    assert all(line.endswith(".") for line in vb.scan(WHISKER, path, SURFACE, speed=0.1).remarks())


def test_a_figure_that_cannot_be_drawn_names_those_that_can(tmp_path):
    motion = vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1)
    vb.save(motion.sample(2000), tmp_path / "scan.nc")
    with refusal("unknown", "figure 8") as caught:
        vb.figure(8, tmp_path)
    assert caught.value.remedy == "they serve figure surface"
    (tmp_path / "scan.nc").rename(tmp_path / "other.nc")
    with refusal("unknown", "figure 8") as caught:
        vb.figure(8, tmp_path)
    assert caught.value.remedy == "they serve no figure"


def test_an_envelope_is_no_stimulus():
    motion = vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1)
    envelope = motion.sample(20e3).envelope.sel(mode=1)
    with refusal("conflict", "stimulus"):
        vb.envelope_coupling(vb.sample_data("spikes.csv"), envelope)


def test_spikes_and_stimulus_that_are_swapped_are_reported_as_swapped():
    spikes, stimulus = vb.sample_data("spikes.csv"), vb.sample_data("spikes-stimulus.csv")
    table = vb.read_spikes(spikes)
    motion = vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1).sample(2000)
    for first, second in ((stimulus, spikes), (stimulus, table), (motion, table)):
        with refusal("conflict", "spikes, stimulus", "them swapped"):
            vb.envelope_coupling(first, second)
    with refusal("unknown", "spikes"):
        vb.envelope_coupling(3.0, stimulus)
    with refusal("unknown", "stimulus"):
        vb.envelope_coupling(spikes, {"a": 1.0})


@pytest.mark.parametrize(
    ("wrong", "shown"),
    [
        (lambda: vb.scan("C2", POSTURE, SURFACE, speed=0.1), "vb.atlas"),
        (lambda: vb.scan(WHISKER, {"contact": 0.3}, SURFACE, speed=0.1), "vb.Posture("),
        (lambda: vb.scan(WHISKER, POSTURE, "plate.csv", speed=0.1), "vb.read_surface"),
        (lambda: vb.scan(WHISKER, POSTURE, np.zeros(9), speed=0.1), "vb.HeightProfile"),
        (lambda: vb.scan(WHISKER, POSTURE, SURFACE, speed="100mm/s"), "0.1 for 100 mm/s"),
        (lambda: vb.scan(WHISKER, POSTURE, SURFACE, spead=0.1), "did you mean speed?"),
        (lambda: vb.decompose("movie.avi", WHISKER, 0.3), "Dataset"),
    ],
)
def test_another_kind_of_thing_is_answered_with_the_right_form(wrong, shown):
    with pytest.raises(vb.InputError) as caught:
        wrong()
    assert shown in caught.value.remedy


def test_a_misspelt_name_is_answered_with_the_nearest():
    with pytest.raises(AttributeError, match="did you mean envelope"):
        vb.envelop  # noqa: B018


def test_a_unit_of_an_envelope_is_drawn_too():
    spikes, rng = vb.read_spikes(vb.sample_data("spikes.csv")), np.random.default_rng(0)
    time = np.arange(0, 4, 1e-3)
    envelope = xr.DataArray(1 + rng.random(time.size), coords={"time": time}, dims="time", attrs={"units": "dB"})
    units = vb.envelope_coupling(spikes, envelope, envelope=True, window=(1.0, 3.0), delays=(0.02,))
    labels = [axis.get_xlabel() for axis in vb.plot_unit(units, "MU001").axes]
    assert any("dB" in label for label in labels)


def test_a_unit_is_drawn_over_the_trials_in_which_it_was_observed_also_from_a_file(tmp_path, monkeypatch):
    from vibrissa.figures.spikes import unit_page

    spikes = vb.read_spikes(vb.sample_data("spikes.csv"))
    n_trials = int(spikes.spike_trial.max()) + 1
    seen = np.arange(n_trials) % 2 == np.zeros((spikes.sizes["unit"], 1))
    units = vb.envelope_coupling(
        spikes.assign(unit_observed=(("unit", "trial"), seen)),
        vb.sample_data("spikes-stimulus.csv"),
        n_trials=None if "n_trials" in spikes.attrs else n_trials,
        delays=(0.5,),
    )
    vb.save(units, tmp_path / "units.nc")
    pages = []
    monkeypatch.setattr(unit_page, "compute", lambda page: pages.append(page))
    monkeypatch.setattr(unit_page, "draw", lambda page: None)
    vb.plot_unit(vb.load(tmp_path / "units.nc"), "MU001")
    (page,) = pages
    assert page.attrs["trials_observed"] == seen[0].sum()
    assert float(page.firing_rate.mean()) == pytest.approx(float(page.predicted_rate.mean()), rel=0.1)
    assert (page.spike_trial.values % 2 == 0).all()


def test_an_object_is_the_stimulus_that_the_same_numbers_in_a_file_are(tmp_path):
    time, rng = np.arange(0, 4, 1e-3), np.random.default_rng(2)
    slow = np.abs(np.convolve(rng.normal(size=time.size), np.ones(60) / 60, "same")) * 1e-4
    table = "\n".join(f"{a!r},{b!r}" for a, b in zip(time.tolist(), slow.tolist(), strict=True))
    (tmp_path / "slow.csv").write_text(f"time,displacement\n{table}\n")
    shown = xr.DataArray(slow, coords={"time": time}, dims="time", attrs={"units": "m"})
    spikes, found = vb.sample_data("spikes.csv"), []
    for stimulus in (shown, str(tmp_path / "slow.csv")):
        with pytest.warns(Remark, match="never negative and has no carrier"):
            found.append(vb.envelope_coupling(spikes, stimulus, window=(0.5, 3.5)))
    np.testing.assert_array_equal(found[0].envelope_correlation, found[1].envelope_correlation)
    with refusal("range", "xarray DataArray"):
        vb.envelope_coupling(spikes, shown - 1e-5, window=(0.5, 3.5))


def test_a_unit_in_another_spelling_is_the_same_unit():
    time = np.arange(0, 4, 1e-3)
    values = 50 * np.sin(2 * np.pi * 70 * time) * (1 + 0.5 * np.sin(9 * time))
    shown = xr.DataArray(values, coords={"time": time}, dims="time", attrs={"units": "µm"})
    spikes = vb.sample_data("spikes.csv")
    named, plain = (vb.envelope_coupling(spikes, shown, window=(0.5, 3.5), unit=unit) for unit in ("um", None))
    np.testing.assert_array_equal(named.envelope_correlation, plain.envelope_correlation)
    with refusal("conflict", "unit"):
        vb.envelope_coupling(spikes, shown, unit="mm")
