"""Pictures of any file: labelled axes, units, intervals, maps as images, the verdict below."""

import io

import numpy as np
import pytest

import vibrissa as vb
from vibrissa.figures.others import contents, scan
from vibrissa.quantities import dataset
from vibrissa.sweep.grid import Grid, Measure
from vibrissa.sweep.maps import sweep

WHISKER, POSTURE = vb.Whisker(length=0.04, cone_angle=1.5e-3), vb.Posture(contact=0.29, base_angle=1.2)
GAPS = vb.periodic_grating(0.02, period=2e-3)


@pytest.fixture(scope="module")
def files():
    """One dataset of each kind that is drawn here."""
    profile = vb.track(vb.sample_data("movie.mkv"), frame_rate=2000, pixel_size=95e-6, skin=[(50.5, 57)], stop=60)
    grid = Grid(contact=[0.2, 0.3, 0.4], base_angle=[1.0, 1.1], speed=[0.1, 0.2], friction=[0.4])
    spikes = vb.read_spikes(vb.sample_data("spikes.csv"))
    return {
        "tracks": profile,
        "modal": vb.decompose(profile, WHISKER, contact=0.29),
        "modes": vb.modes(WHISKER, POSTURE),
        "profile": vb.profile(WHISKER, POSTURE),
        "gap": vb.gap(WHISKER, POSTURE, width=0.6e-3),
        "map": sweep(WHISKER, GAPS, grid, Measure()),
        "spikes": spikes,
        "units": vb.envelope_coupling(spikes, vb.sample_data("spikes-stimulus.csv")),
    }


def test_spikes_of_other_programs_are_drawn_without_names_and_with_labels_of_their_own(files):
    bare = files["spikes"][["spike_time", "spike_unit", "spike_trial"]].drop_vars(["unit", "trial"], errors="ignore")
    named = bare.assign(unit_name=files["spikes"].unit_name.drop_vars("unit"))
    named = named.assign_coords(unit=[f"n{k}" for k in range(named.sizes["unit"])])
    for spikes in (bare, named):
        drawn = contents.compute(spikes)
        assert drawn.spike_time.equals(files["spikes"].spike_time)
        assert contents.draw(drawn).axes


@pytest.mark.parametrize("kind", ["tracks", "modal", "modes", "profile", "gap", "map", "spikes", "units"])
def test_every_panel_says_what_its_axes_are(files, kind):
    figure = contents.draw(contents.compute(files[kind]))
    figure.savefig(io.BytesIO())
    for axis in figure.axes:
        if axis.get_label() == "<colorbar>":
            continue
        assert axis.get_title(loc="left") or axis.get_ylabel()
        assert axis.get_xlabel()
        labels = [text.get_text() for text in axis.get_xticklabels() if text.get_text()]
        assert len(set(labels)) == len(labels)


@pytest.mark.parametrize("kind", ["gap", "map"])
def test_the_caption_holds_the_verdict(files, kind):
    assert f"Verdict: {files[kind].attrs['verdict']}." in contents.compute(files[kind]).attrs["caption"]


def test_the_caption_of_a_scan_holds_the_verdict():
    data = vb.scan(WHISKER, POSTURE, GAPS, speed=0.1).sample(4000)
    assert data.attrs["verdict"].split(":")[0] in ("usable", "caution", "outside the model")
    assert f"Verdict: {data.attrs['verdict']}." in scan.compute(data).attrs["caption"]


def test_a_map_is_an_image_at_the_first_of_several_speeds(files):
    panels = contents.draw(contents.compute(files["map"])).axes
    titled = [axis for axis in panels if axis.get_title(loc="left")]
    assert [axis.get_title(loc="left").endswith("at speed 0.1 m/s") for axis in titled] == [True, False]
    assert all(len(axis.collections) == 1 for axis in titled)
    np.testing.assert_allclose(
        titled[0].collections[0].get_array().ravel(), files["map"].peak_displacement[0, 0].values.ravel()
    )


def test_a_table_of_units_has_their_names_and_intervals(files):
    panels = contents.draw(contents.compute(files["units"])).axes
    threshold = panels[0]
    assert "envelope above which the rate rises" in threshold.get_title(loc="left")
    assert [text.get_text() for text in threshold.get_xticklabels()] == ["MU001", "MU002", "SU001"]
    assert len(threshold.containers) == 1  # error bars
    assert threshold.yaxis.get_major_formatter()(5e-5) == "50 µm"


def test_the_node_that_is_drawn_in_time_is_the_one_that_moves_most(files):
    drawn = contents.compute(files["tracks"])
    swing = files["tracks"].y.std("time").max()
    np.testing.assert_allclose(drawn.tracked_motion.std("time").max(), swing, rtol=1e-6)


def test_of_a_long_grating_the_first_gaps_are_drawn():
    long = vb.HeightProfile.from_gaps(vb.periodic_grating(1.0, period=2e-3))
    height = dataset(time=np.arange(2.0)).assign(height=("position", long.height, {"units": "m"}))
    drawn = contents.compute(height.assign_coords(position=("position", long.position, {"units": "m"})))
    assert drawn.sizes["position"] == 120
    assert drawn.attrs["caption"].startswith("The first ")


def test_numbers_without_a_dimension_are_refused():
    with pytest.raises(vb.InputError, match="must hold numbers along a dimension"):
        contents.compute(dataset(contact=0.3))
