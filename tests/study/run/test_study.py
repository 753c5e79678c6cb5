"""A small virtual experiment, run whole: what was put in comes out, and nothing is left half-written."""

import dataclasses
import json
import re
import tomllib
from importlib import resources

import numpy as np
import pytest
from refusals import refusal
from threadpoolctl import threadpool_limits

from vibrissa.figures.paper import fig3, fig4, fig5, fig6, fig8
from vibrissa.netcdf import load
from vibrissa.study.movie.backward import analyse
from vibrissa.study.report.headlines import headlines
from vibrissa.study.run import study as study_module
from vibrissa.study.run.study import run_study
from vibrissa.study.spec.settings import Study, read_study


def small(study: Study, **film) -> Study:
    return dataclasses.replace(study, laboratory=None, cortex=None, film=dataclasses.replace(study.film, **film))


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "out"
    run_study(small(read_study(), n_frames=1200), folder)
    return folder


@pytest.fixture(scope="module")
def results(out):
    return {path.stem: load(path) for path in out.glob("*.nc")}


def row(results, quantity):
    table = results["verdict"]
    return table.isel(entry=list(table.quantity.values).index(quantity))


def test_fit_on_the_tracked_movie_agrees_with_the_fit_on_the_true_signal(results):
    frequency = row(results, "resonant frequency, mode 1, against the true signal")
    damping = row(results, "damping ratio, mode 1, against the true signal")
    np.testing.assert_allclose(frequency.found, frequency.truth, rtol=2e-3)
    np.testing.assert_allclose(damping.found, damping.truth, rtol=3e-2)


def test_what_was_put_in_lies_near_what_comes_out(results):
    frequency, damping = row(results, "resonant frequency, mode 1"), row(results, "damping ratio, mode 1")
    np.testing.assert_allclose(frequency.found, frequency.truth, rtol=2e-3)
    np.testing.assert_allclose(damping.found, damping.truth, rtol=3e-2)
    assert frequency.found_low < frequency.found < frequency.found_high


def test_tracked_modes_follow_the_true_ones(results):
    true = results["prediction"].mode_displacement.values
    found = results["modal"].mode_displacement.values
    for mode, least in ((0, 0.999), (1, 0.99), (2, 0.9)):  # mode 3 moves by a hundredth of a pixel
        assert np.corrcoef(true[mode], found[mode])[0, 1] > least
    # a displacement along the normal, away from the substrate: the sign is the model's own
    slope = (true[0] - true[0].mean()) @ found[0] / np.sum((true[0] - true[0].mean()) ** 2)
    np.testing.assert_allclose(slope, 1, atol=0.005)


def test_standard_deviations_of_the_amplitudes_are_those_of_their_errors(results):
    true = results["prediction"].mode_displacement.values[0]
    error = results["modal"].mode_displacement.values[0] - (true - true.mean())
    stated = np.median(results["modal"].mode_displacement_sd.values[0])
    assert 0.5 < stated / error.std() < 2


def test_the_paper_s_projection_leans_on_the_same_motion(results, out):
    study = read_study()
    profile = load(out / "profile.nc").isel(whisker=0)
    printed = analyse(profile, study.whisker, study.posture.contact, method="paper2014")["modal"]
    found = results["modal"]
    assert np.corrcoef(printed.mode_displacement[0], found.mode_displacement[0])[0, 1] > 0.99


def test_report_is_one_file_with_its_figures_and_no_address_outside(out):
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("<figcaption>") == page.count("<svg ") == 6
    assert not re.search(r'(?:src|href)="(?!#|data:)', page)
    assert page.index("Contents") < page.index('<h2 id="section-1">')
    assert "All data are simulated" in page
    assert "Left out" not in page
    assert "about the curved profile the first resonance is off the straight shaft's by" in page.replace("&#39;", "'")


def test_equal_studies_give_equal_bytes_however_many_threads_there_are(tmp_path):
    study = small(read_study(), n_frames=300)
    for name, threads in (("a", 1), ("b", 2)):
        with threadpool_limits(threads):
            run_study(study, tmp_path / name)
    made = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert "movie.mkv" in made
    for name in made:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


def test_the_numbers_in_the_end_are_those_of_the_movie_with_their_truth(results):
    done, _, *rows = headlines(results)
    assert done.startswith("1200 frames tracked")
    assert [row.split()[0] for row in rows[:4]] == ["resonant", "damping", "correlation", "contact"]
    truth, found = map(float, rows[3].split()[5:7])
    assert found == pytest.approx(truth, abs=5e-3)


def test_a_failure_leaves_nothing_behind(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(study_module, "write_report", full)
    with refusal("machine", "out"):
        run_study(small(read_study(), n_frames=300), tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_figures_hold_what_their_captions_claim(results):
    envelopes = fig6.compute(results)
    assert envelopes.correlation.values.min() > 0.98
    np.testing.assert_allclose(envelopes.envelope_found.mean("time"), 1)
    modes = fig4.compute(results)
    rest = modes.deformation - modes.mode_part.sum("mode")
    assert float((rest**2).sum()) < 0.02 * float((modes.deformation**2).sum())
    spectra = fig5.compute(results)
    band = np.isfinite(spectra.power_fit.values[0])
    tracked, known, white = (np.log(spectra[n].values[0, band]) for n in ("power", "power_fit", "power_white_fit"))
    assert np.std(tracked - known) < 0.1  # the texture's own forcing explains the ripples …
    assert np.std(tracked - white) > 0.3  # … which white forcing cannot
    frame = fig3.compute(results)
    on_line = frame.image.values[
        np.round(frame.line_row[0].values[5:200]).astype(int), np.round(frame.line_column[0].values[5:200]).astype(int)
    ]
    assert on_line.mean() < np.median(frame.image) - 20  # the line lies on the dark whisker
    assert fig8.compute(results).attrs["correlation"] > 0.6


def test_a_movie_without_a_whisker_gets_no_modes_and_the_report_says_why(out, tmp_path):
    scene = load(out / "profile.nc")
    seed = json.loads(scene.attrs["seeds"])[0]
    (tmp_path / "study.toml").write_text(
        f'name = "recorded"\nassumptions = ["a scale"]\n[movie]\npath = "{out / "movie.mkv"}"\n'
        f"frame_rate = 2000.0\npixel_size = 95e-6\nseeds = [{seed}]\n"
    )
    table = run_study(read_study(tmp_path / "study.toml"), tmp_path / "out")
    assert int(table.frames_followed[0]) == 1200
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "no [whisker] and no [posture]" in page
    assert "a scale" in page
    assert not (tmp_path / "out" / "modal.nc").exists()


# The study file


def experiment(**changes):
    text = resources.files("vibrissa.data").joinpath("experiment.toml").read_text()
    assert tomllib.loads(text)
    for old, new in changes.values():
        assert old in text
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize(
    ("change", "code", "quantity", "rule", "remedy"),
    [
        (
            ("base_angle = 1.2", "base_angel = 1.2"),
            "unknown",
            "study.toml: [posture]: key 'base_angel'",
            "is unknown",
            "did you mean base_angle?",
        ),
        (("[posture]", "[postur]"), "unknown", "study.toml: key 'postur'", "is unknown", "did you mean posture?"),
        (("speed = 0.1 ", "speed = -0.1 "), "format", "study.toml: scan", "Scan.speed must be positive", ""),
        (
            ("contact = 0.29", "contact = 29"),
            "format",
            "study.toml: posture",
            "Posture.contact must lie between 0 and 1",
            "",
        ),
        (("contact = 0.29", 'contact = "far"'), "format", "study.toml: posture.contact", "not 'far'", ""),
        (('jump = "continuous"', 'jump = "springy"'), "format", "study.toml: scan.jump", "not 'springy'", ""),
        (("length = 0.040", "length = nan"), "format", "study.toml: whisker", "Whisker.length must be positive", ""),
        (("[film]\nn_frames = 3500", "[film]"), "format", "study.toml: film.n_frames", "must be given", ""),
        (("[whisker]", "[whisker"), "format", "study.toml", "must be TOML", ""),
    ],
)
def test_a_wrong_study_file_is_told_in_one_line(tmp_path, change, code, quantity, rule, remedy):
    path = tmp_path / "study.toml"
    path.write_text(experiment(change=change))
    with refusal(code, quantity) as caught:
        read_study(path)
    assert rule in caught.value.rule
    assert remedy in caught.value.remedy


def test_a_study_needs_a_movie_or_a_film(tmp_path):
    (tmp_path / "study.toml").write_text('name = "empty"\n')
    with refusal("format", "study.toml: study"):
        read_study(tmp_path / "study.toml")


def test_a_contact_beyond_the_tip_is_refused(tmp_path):
    (tmp_path / "study.toml").write_text(experiment(tip=("tip = 0.05 ", "tip = 0.35 ")))
    with refusal("format", "study.toml: study"):
        read_study(tmp_path / "study.toml")
