"""Pages of units: what is drawn is what was found, one page for each, and a table that a click sorts."""

import base64
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest
from populations import ringing
from refusals import refusal

from vibrissa.figures.spikes import population, unit_page
from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.coupling.unit_view import UnitViews, autocorrelogram
from vibrissa.neural.io.tables.spikes import join_units
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, simulate_spikes
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.neurons.neurons import Analysed
from vibrissa.study.report.pages import write_picture
from vibrissa.study.report.unit_pages import chosen, write_unit_pages

N_TRIALS = 12
ODD = "<b>u&1 $x$ $y$"  # HTML and mathematics in a name
TRUTH = {
    ODD: ThresholdLinearUnit(slope=1e6),
    "idle": ThresholdLinearUnit(slope=0.0),
    "rare": ThresholdLinearUnit(slope=0.0, baseline=0.05),
}
HOW = EnvelopeAnalysis(n_resamples=40)
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def found():
    rng = np.random.default_rng(3)
    time, moved = ringing(rng, duration=6.0)
    envelope = analytic_envelope(moved)[0]
    spikes = join_units({n: simulate_spikes(one, time, envelope, N_TRIALS, rng=rng) for n, one in TRUTH.items()})
    stimulus = dataset(time=time, point_displacement=moved)
    return Analysed(analyse_units(spikes, stimulus, N_TRIALS, HOW), spikes, stimulus, N_TRIALS, HOW, [])


@pytest.fixture(scope="module")
def views(found):
    return UnitViews.of(found.units, found.spikes, found.stimulus, found.how)


@pytest.fixture(scope="module")
def page(views):
    data = unit_page.compute(views.of_unit(0))
    return data, unit_page.draw(data)


def panel(figure, letter):
    (one,) = [axis for axis in figure.axes if axis.get_title(loc="left").startswith(letter)]
    return one


def test_raster_holds_every_spike_of_the_stretch(found, page):
    (line,) = panel(page[1], "A").lines
    own = found.spikes.spike_unit.values == 0
    time, trial = found.spikes.spike_time.values[own], found.spikes.spike_trial.values[own]
    seen = (time >= 1) & (time < 6)
    np.testing.assert_array_equal(line.get_xdata(orig=False), time[seen])
    np.testing.assert_array_equal(line.get_ydata(orig=False), trial[seen])


def test_rate_and_fit_are_counts_and_the_hinge_of_the_table(found, page):
    axis, unit = panel(page[1], "B"), found.units.isel(unit=0)
    own = found.spikes.spike_time.values[found.spikes.spike_unit.values == 0]
    edges = 1 + 0.01 * np.arange(501)
    counted = np.histogram(own + 1e-9, edges)[0] / (N_TRIALS * 0.01)
    np.testing.assert_allclose(axis.patches[0].get_data().values, counted)
    time, envelope = found.stimulus.time.values, analytic_envelope(found.stimulus.point_displacement.values)[0]
    (fit,) = axis.lines
    at = 2.0 - float(unit.latency) + np.linspace(0, 0.01, 2001)  # the bin from 2.00 to 2.01 s
    above = np.maximum(np.interp(at, time, envelope) - float(unit.threshold), 0).mean()
    expected = float(unit.baseline) + float(unit.slope) * above
    place = np.argmin(abs(fit.get_xdata(orig=False) - 2.005))
    assert fit.get_ydata(orig=False)[place] == pytest.approx(expected, rel=0.02)


def test_curve_and_residuals_are_the_classes_of_the_table(found, page):
    unit, figure = found.units.isel(unit=0), page[1]
    curve = panel(figure, "D")
    points, fit = curve.containers[0].lines[0], curve.lines[-1]
    np.testing.assert_allclose(points.get_xdata(orig=False), 1e6 * unit.response_envelope)
    np.testing.assert_allclose(points.get_ydata(orig=False), unit.response_rate)
    np.testing.assert_allclose(fit.get_ydata(orig=False), unit.response_rate_fitted)
    (below,) = [axis for axis in figure.axes if axis.get_ylabel() == "rate − fit [Hz]"]
    left = below.containers[0].lines[0].get_ydata(orig=False)
    np.testing.assert_allclose(left, unit.response_rate.values - unit.response_rate_fitted.values)


def test_correlogram_is_pearsons_r_and_its_peak_that_of_the_table(found, page, views):
    axis, unit = panel(page[1], "E"), found.units.isel(unit=0)
    tested = axis.lines[-1]
    assert tested.get_xdata(orig=False).tolist() == pytest.approx([0, 10, 20, 30])
    assert tested.get_ydata(orig=False).max() == pytest.approx(float(unit.envelope_correlation))
    record = views.record
    both = record.rate_valid[2:] & record.envelope_valid[:-2]
    r = np.corrcoef(record.rates[0][2:][both], record.envelope[:-2][both])[0, 1]
    assert tested.get_ydata(orig=False)[2] == pytest.approx(r, rel=1e-6)
    data = page[0]
    assert data.attrs["chance_low"] < 0 < data.attrs["chance_high"] < data.attrs["chance_level"]
    assert data.attrs["chance_level"] < float(unit.envelope_correlation)  # p is below the level


def test_autocorrelogram_counts_pairs_one_by_one():
    rng = np.random.default_rng(2)
    time, trial = rng.uniform(0, 1, 60), rng.integers(0, 4, 60)
    lags, rate = autocorrelogram(time, trial, 1.0, reach=0.2, width=0.01)
    counts, first = np.zeros(20), time <= 0.8
    for i in np.flatnonzero(first):
        for j in range(60):
            gap = time[j] - time[i]
            if i != j and trial[i] == trial[j] and 0 <= gap < 0.2:
                counts[int(gap / 0.01)] += 1
    np.testing.assert_allclose(rate, counts / (first.sum() * 0.01))
    assert lags[1] == pytest.approx(0.01)


def test_autocorrelogram_of_a_poisson_train_is_its_rate():
    time = np.sort(np.random.default_rng(1).uniform(0, 2000, 40_000))
    rate = autocorrelogram(time, np.zeros(time.size, int), 2000.0)[1]
    np.testing.assert_allclose(rate, 20, atol=5 * np.sqrt(20 / (time.size * 1e-3)))


def test_what_is_absent_is_said_in_place_of_an_empty_frame(views, found):
    idle = unit_page.draw(unit_page.compute(views.of_unit(1)))
    assert "no waveform in the file" in [text.get_text() for text in panel(idle, "G").texts]
    assert not panel(idle, "G").axison
    assert not panel(idle, "B").lines  # no fit
    assert "no significant coupling" in idle.caption.lower()
    binned = found.spikes.assign_attrs(counted_bin=0.01)
    told = UnitViews.of(found.units, binned, found.stimulus, found.how).of_unit(0)
    assert np.isnan(told.autocorrelogram.values).all()
    silent = replace(views, record=replace(views.record, rates=0 * views.record.rates)).of_unit(2)
    figure = unit_page.draw(unit_page.compute(silent))
    assert "constant" in panel(figure, "E").texts[0].get_text()


def test_waveform_of_the_file_is_drawn_in_microvolts(found):
    shapes = np.random.default_rng(0).normal(size=(3, 40)) * 1e-5
    spikes = found.spikes.assign(unit_waveform=(("unit", "sample"), shapes)).assign_attrs(sampling_rate=20000.0)
    view = UnitViews.of(found.units, spikes, found.stimulus, found.how).of_unit(1)
    line = panel(unit_page.draw(unit_page.compute(view)), "G").lines[-1]
    np.testing.assert_allclose(line.get_ydata(orig=False), 1e6 * shapes[1])
    assert line.get_xdata(orig=False)[-1] == pytest.approx(39 / 20)


def test_population_counts_what_the_table_has(found):
    data = population.compute(found.units)
    figure = population.draw(data)
    bars = {patch.get_y() + patch.get_height() / 2: patch.get_width() for patch in panel(figure, "F").patches}
    assert sum(bars.values()) == 3
    assert bars[5] == (~found.units.significant.values).sum()
    known = panel(figure, "C").lines[0]
    fitted = found.units.isel(unit=np.flatnonzero(found.units.identified.values))
    np.testing.assert_allclose(known.get_xdata(orig=False), 1e6 * fitted.threshold)
    np.testing.assert_allclose(known.get_ydata(orig=False), 1e-6 * fitted.slope)
    none = population.draw(population.compute(found.units.isel(unit=[1, 2])))
    assert panel(none, "B").texts[0].get_text() == "no unit is fitted"


def svgs(page):
    return [ElementTree.fromstring(one) for one in re.findall(r"<svg.*?</svg>", page, re.DOTALL)]


def test_html_has_a_page_for_each_unit_and_names_as_text(found, tmp_path):
    path = tmp_path / "units.html"
    assert write_unit_pages(found, path, remarks=["a < b"]) == ""
    page = path.read_text()
    assert re.findall(r'<section id="([^"]*)"', page) == ["unit-0001", "unit-0002", "unit-0003"]
    assert len(svgs(page)) == 4  # and the population
    assert re.findall(r'<a href="#([^"]*)">idle', page) == ["unit-0002"]
    assert "<b>u" not in page
    assert page.count("&lt;b&gt;u&amp;1 $x$ $y$") >= 2  # in the table and in the heading
    assert "a &lt; b" in page
    assert not re.search(r'(src|href)="(?!#|data:)', page)  # nothing from elsewhere
    ids = re.findall(r' id="([^"]*)"', page)
    assert not [one for one in ids if one.startswith(("figure_", "axes_", "line2d_"))]


def test_svg_holds_the_curve_that_was_drawn(found, page, tmp_path):
    """The drawn path, back in units of the data, is the fit in the classes of the envelope."""
    figure = unit_page.draw(page[0])
    axis = panel(figure, "D")
    axis.lines[-1].set_gid("the-fit")
    write_picture(figure, tmp_path / "one.html")
    (svg,) = svgs((tmp_path / "one.html").read_text())
    (group,) = [one for one in svg.iter(f"{SVG}g") if one.get("id") == "the-fit"]
    numbers = np.array(re.findall(r"-?\d+\.?\d*", group.find(f"{SVG}path").get("d")), float).reshape(-1, 2)
    height = float(svg.get("viewBox").split()[3])
    pixels = np.column_stack([numbers[:, 0], height - numbers[:, 1]]) * figure.dpi / 72
    back = axis.transData.inverted().transform(pixels)
    np.testing.assert_allclose(back[:, 0], 1e6 * page[0].response_envelope, rtol=1e-3)
    np.testing.assert_allclose(back[:, 1], page[0].response_rate_fitted, rtol=1e-3)


def test_folder_and_pdf_have_as_many_pages_and_old_ones_go(found, tmp_path):
    folder = tmp_path / "pages"
    assert write_unit_pages(found, folder) == ""
    assert sorted(one.name for one in folder.iterdir()) == ["index.html", *(f"unit-000{k}.html" for k in (1, 2, 3))]
    assert re.findall(r'<a href="(unit[^"]*)"', (folder / "index.html").read_text()) == [
        f"unit-000{k}.html" for k in (1, 2, 3)
    ]
    write_unit_pages(found, folder, named=["idle"])
    assert sorted(one.name for one in folder.iterdir()) == ["index.html", "unit-0002.html"]
    write_unit_pages(found, tmp_path / "units.pdf", named=["idle", "rare"])
    assert len(re.findall(rb"/Type /Page\b", (tmp_path / "units.pdf").read_bytes())) == 3


def test_units_without_a_page_are_counted_never_dropped_silently(found, tmp_path):
    told = write_unit_pages(found, tmp_path / "units.html", most=1)
    assert told.startswith("1 of 3 units have a page")
    page = (tmp_path / "units.html").read_text()
    assert len(re.findall("<section", page)) == 1
    assert len(re.findall("<tr>", page)) == 4  # all of them in the table
    assert chosen(found.units, 1) == [0]
    assert "population" in write_unit_pages(found, tmp_path / "units.png")
    with refusal("unknown", "unit page"):
        write_unit_pages(found, tmp_path / "units.html", named=["u9"])
    with refusal("range", "unit page"):
        write_unit_pages(found, tmp_path / "units.svg", named=["idle", "rare"])


def test_equal_units_give_equal_bytes(found, tmp_path):
    for name in ("a.html", "b.html"):
        write_unit_pages(found, tmp_path / name, named=["rare"])
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


def test_crowded_rasters_are_pixels_within_the_vectors(page, tmp_path):
    many = page[0].isel(spike=np.arange(4000) % page[0].sizes["spike"])
    write_picture(unit_page.draw(many), tmp_path / "many.html")
    (inner,) = re.findall(r'xlink:href="data:image/png;base64,([^"]*)"', (tmp_path / "many.html").read_text())
    assert base64.b64decode(inner)[:4] == b"\x89PNG"
