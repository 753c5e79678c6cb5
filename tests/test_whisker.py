import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.errors import InputError
from vibrissa.quantities import require
from vibrissa.whisker import Whisker, atlas, atlas_whisker, from_diameters, isolated_whiskers, read_diameters

LENGTHS = st.floats(1e-3, 0.99)
ANGLES = st.floats(1e-4, 0.09)
SHARED = Path(__file__).parents[2] / "shared" / "data" / "geometry"


def cone_diameters(length, cone_angle, distance):
    return 2 * cone_angle * (length - distance)


# exact solutions


def test_timescale_of_the_reference_whisker():
    whisker = Whisker(length=0.04, cone_angle=1.5e-3, youngs_modulus=3.74e9, density=1140)
    assert whisker.timescale == pytest.approx(29.44e-3, abs=6e-6)  # quoted cut, not rounded: 29.4452
    assert whisker.base_radius == pytest.approx(60e-6)


@settings(deadline=None)  # the first call imports SciPy
@given(LENGTHS, ANGLES, st.floats(0, 0.9), st.integers(3, 40))
def test_the_diameters_of_a_cone_give_the_cone_back(length, cone_angle, tip, points):
    distance = np.linspace(0, length * (1 - tip), points)
    fit = from_diameters(distance, cone_diameters(length, cone_angle, distance))
    assert fit.whisker.length == pytest.approx(length, rel=1e-10)
    assert fit.whisker.cone_angle == pytest.approx(cone_angle, rel=1e-10)
    assert fit.whisker.tip == pytest.approx(tip, abs=1e-10)
    assert fit.whisker.timescale == pytest.approx(Whisker(length=length, cone_angle=cone_angle).timescale, rel=1e-9)
    assert fit.r_squared == pytest.approx(1, abs=1e-12)
    assert fit.length_se < 1e-9 * length


def test_errors_of_three_points_worked_by_hand():
    # d = 100, 67, 40 µm at 0, 10, 20 mm: A = 99 µm, B = 3 µm/mm, residuals 1, −2, 1 µm, variance 6 µm² on one degree
    fit = from_diameters([0, 10e-3, 20e-3], [100e-6, 67e-6, 40e-6])
    assert fit.whisker.base_radius == pytest.approx(49.5e-6)
    assert fit.whisker.cone_angle == pytest.approx(1.5e-3)
    assert fit.whisker.length == pytest.approx(33e-3)
    assert fit.whisker.tip == pytest.approx(13 / 33)
    assert fit.residual_sd == pytest.approx(math.sqrt(6) * 1e-6)
    assert fit.cone_angle_se == pytest.approx(math.sqrt(6 / 200) / 2 * 1e-3)
    assert fit.base_radius_se == pytest.approx(math.sqrt(6 * (1 / 3 + 100 / 200)) / 2 * 1e-6)
    # L is where the line vanishes: its error is that of the line there, over the slope
    assert fit.length_se == pytest.approx(math.sqrt(6 * (1 / 3 + (33 - 10) ** 2 / 200)) / 3 * 1e-3)
    assert fit.r_squared == pytest.approx(1 - 6 / 1806)


# laws that hold for any input


@given(LENGTHS, ANGLES, st.floats(0.1, 1), st.floats(0.1, 1), st.floats(0.1, 10))
def test_timescale_goes_as_length_over_angle_times_the_slowness_of_sound(length, angle, shorter, finer, softer):
    k = Whisker(length=length, cone_angle=angle).timescale
    assert Whisker(length=length * shorter, cone_angle=angle).timescale == pytest.approx(k * shorter)
    assert Whisker(length=length, cone_angle=angle * finer).timescale == pytest.approx(k / finer)
    soft = Whisker(length=length, cone_angle=angle, youngs_modulus=3.74e9 / softer, density=1140 * softer)
    assert soft.timescale == pytest.approx(k * softer)


@given(LENGTHS, st.floats(0, 0.999))
def test_cutting_the_tip_changes_the_physical_length_alone(length, tip):
    whole, cut = Whisker(length=length, cone_angle=1e-3), Whisker(length=length, cone_angle=1e-3, tip=tip)
    assert cut.physical_length == pytest.approx(length * (1 - tip))
    assert (cut.timescale, cut.base_radius) == (whole.timescale, whole.base_radius)


@settings(deadline=None)  # the first call imports SciPy
@given(st.permutations(range(6)))
def test_the_order_of_the_points_does_not_matter(order):
    distance = np.linspace(0, 30e-3, 6)
    diameter = cone_diameters(0.04, 1.5e-3, distance) + 1e-6 * np.sin(7 * np.arange(6))
    fit, shuffled = (from_diameters(distance[list(o)], diameter[list(o)]) for o in (range(6), order))
    assert shuffled.whisker.length == pytest.approx(fit.whisker.length, rel=1e-12)
    assert shuffled.length_se == pytest.approx(fit.length_se, rel=1e-9)


def test_standard_errors_cover_the_truth_as_often_as_they_should():
    rng = np.random.default_rng(20140226)
    truth = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.2)
    distance = np.linspace(0, truth.physical_length, 30)
    clean = cone_diameters(truth.length, truth.cone_angle, distance)
    fits = [from_diameters(distance, clean + rng.normal(0, 3e-6, distance.size)) for _ in range(2000)]
    reach = 2.0484  # Student's t at 97.5 %, 28 degrees of freedom
    for name in ("length", "cone_angle", "base_radius", "tip", "timescale"):
        error = np.array([getattr(fit.whisker, name) - getattr(truth, name) for fit in fits])
        se = np.array([getattr(fit, f"{name}_se") for fit in fits])
        # 4 binomial standard errors of 2000 draws; the ratio L and the quotient k are skewed a little
        assert np.mean(np.abs(error) < reach * se) == pytest.approx(0.95, abs=0.02), name
        assert np.sqrt(np.mean(se**2)) == pytest.approx(np.std(error), rel=0.07), name


def test_a_longer_physical_length_moves_the_tip_alone():
    distance = np.linspace(0, 20e-3, 9)
    diameter = cone_diameters(0.04, 1.5e-3, distance)
    bound, told = from_diameters(distance, diameter), from_diameters(distance, diameter, physical_length=36e-3)
    assert bound.whisker.tip == pytest.approx(0.5)
    assert told.whisker.tip == pytest.approx(0.1)
    assert told.whisker.length == bound.whisker.length


def test_a_tip_a_little_beyond_the_noisy_cone_counts_as_sharp():
    rng = np.random.default_rng(5)
    distance = np.linspace(0, 40e-3, 20)
    clean = cone_diameters(0.04, 1.5e-3, distance)
    tips = [from_diameters(distance, np.abs(clean + rng.normal(0, 1e-6, 20))).whisker.tip for _ in range(50)]
    assert min(tips) == 0
    assert max(tips) < 0.05


# what is refused


def passes(distance, diameter):
    try:
        from_diameters(distance, diameter)
    except InputError:
        return False
    return True


def test_a_noisy_cylinder_passes_for_a_cone_at_most_one_time_in_twenty():
    rng = np.random.default_rng(11)
    distance = np.linspace(0, 20e-3, 6)
    passed = np.mean([passes(distance, 1e-4 + rng.normal(0, 2e-6, 6)) for _ in range(2000)])
    assert passed <= 0.05 + 4 * math.sqrt(0.05 * 0.95 / 2000)


@pytest.mark.parametrize("bad", [0, -1e-3, math.nan, math.inf])
@pytest.mark.parametrize("name", ["length", "cone_angle", "youngs_modulus", "density"])
def test_a_parameter_must_be_positive_and_finite(name, bad):
    with refusal("range", f"Whisker.{name}", str(bad)) as caught:
        Whisker(**{"length": 0.04, "cone_angle": 1.5e-3, name: bad})
    assert caught.value.rule == "must be positive and finite"


@pytest.mark.parametrize(("name", "bad", "most", "unit"), [("length", 40, "1", "m"), ("cone_angle", 1.5, "0.1", "rad")])
def test_a_slip_of_the_unit_is_refused(name, bad, most, unit):
    with refusal("range", f"Whisker.{name}", str(bad)) as caught:
        Whisker(**{"length": 0.04, "cone_angle": 1.5e-3, name: bad})
    assert (caught.value.rule, caught.value.remedy) == (
        f"must be at most {most} {unit}",
        f"give it in {unit}: {bad / 1000:g} for {bad:g} m{unit}",
    )


@pytest.mark.parametrize("bad", [-0.1, 1, 1.5, math.nan])
def test_the_tip_must_lie_on_the_whisker(bad):
    with refusal("range", "Whisker.tip"):
        Whisker(length=0.04, cone_angle=1.5e-3, tip=bad)


@pytest.mark.parametrize(
    "diameter",
    [np.full(5, 1e-4), np.full(5, 0.1 + 0.2), 1e-4 + 1e-6 * np.array([0, 1, -1, 1, 0]), np.linspace(1e-4, 2e-4, 5)],
    ids=["exact cylinder", "rounded cylinder", "noisy cylinder", "widening"],
)
def test_a_cylinder_is_refused(diameter):
    with refusal("range", "diameters"):
        from_diameters(np.linspace(0, 0.02, 5), diameter)


@pytest.mark.parametrize(
    ("distance", "diameter", "message"),
    [
        ([0, 1e-2], [1e-4, 5e-5], ("too-few", "diameters")),
        ([0, 0, 0, 1e-2], [1e-4] * 4, ("too-few", "diameters")),
        ([0, 1e-2, 2e-2], [1e-4, 5e-5], ("shape", "distance and diameter")),
        (0.0, 1e-4, ("shape", "distance and diameter")),
        ([0, -1e-2, 2e-2], [1e-4] * 3, ("range", "distance of point 2")),
        ([0, 1e-2, 2e-2], [1e-4, 5e-5, math.nan], ("range", "diameter of point 3")),
        ([0, 1, 2], [1e-4, 5e-5, 1e-5], ("range", "Whisker.length")),
    ],
)
def test_bad_points_are_refused(distance, diameter, message):
    with refusal(*message):
        from_diameters(distance, diameter)


@pytest.mark.parametrize(
    ("length", "message"),
    [
        (10e-3, ("range", "physical_length")),
        (math.nan, ("range", "physical_length")),
        (50e-3, ("range", "a whisker of 50 mm")),
    ],
)
def test_an_impossible_physical_length_is_refused(length, message):
    distance = np.linspace(0, 30e-3, 5)
    with refusal(*message):
        from_diameters(distance, cone_diameters(0.04, 1.5e-3, distance), physical_length=length)


# files


@pytest.mark.parametrize(
    "text",
    [
        "distance,diameter\n0,120e-6\n0.01,90e-6\n0.02,60e-6\n",
        "\ufeffwhisker,diameter_um,distance_mm\r\nC2,120,0\r\nC2,90,10\r\n\r\nC2,60,20\r\n",
    ],
    ids=["metres", "mm and µm, another column, another order, a blank line"],
)
def test_a_file_of_diameters_is_read_in_the_units_of_its_header(tmp_path, text):
    path = tmp_path / "c2.csv"
    path.write_bytes(text.encode())
    data = read_diameters(path)
    require(data, "distance", "diameter")
    np.testing.assert_allclose(data.distance, [0, 0.01, 0.02], rtol=1e-12)
    np.testing.assert_allclose(data.diameter, [120e-6, 90e-6, 60e-6], rtol=1e-12)
    assert from_diameters(data.distance, data.diameter).whisker.length == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", ("too-few", "bad.csv")),
        ("distance;diameter\n0;1\n", ("format", "bad.csv, line 1")),
        ("distance,width\n0,1\n", ("missing", "bad.csv, line 1")),
        ("distance,distance_mm,diameter\n0,0,1\n", ("missing", "bad.csv, line 1")),
        ("distance,diameter\n", ("too-few", "bad.csv")),
        ("distance,diameter\n0,1e-4\n0.01,thin\n", ("format", "bad.csv, line 3, diameter")),
        ("distance,diameter\n0,1e-4\n0.01\n", ("shape", "bad.csv, line 3")),
        ("distance,diameter\n0,1e-4\n0.01,\n", ("format", "bad.csv, line 3, diameter")),
        ("distance,diameter\n-0.01,1e-4\n", ("format", "bad.csv, line 2, distance")),
        ("distance,diameter\n0,nan\n", ("format", "bad.csv, line 2, diameter")),
    ],
)
def test_a_bad_file_is_refused_in_one_line(tmp_path, text, message):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with refusal(*message) as caught:
        read_diameters(path)
    assert "bad.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_no_text_file_is_refused(tmp_path):
    (tmp_path / "movie.csv").write_bytes(b"\xff\xd8\xff\xe0\x00\x10")
    for name, code, rule in (
        ("movie.csv", "format", "must be text"),
        ("absent.csv", "missing", "must be an existing file"),
        (".", "missing", "must be an existing file"),
    ):
        with refusal(code, str(tmp_path / name)) as caught:
            read_diameters(tmp_path / name)
        assert caught.value.rule.startswith(rule)


# the atlas


def test_every_position_has_one_name_and_every_cone_a_whisker():
    names = [entry.name for entry in atlas()]
    assert len(set(names)) == len(names) == 33
    assert sum(entry.n for entry in atlas()) == 519
    assert sum(entry.n_cone for entry in atlas()) == 122
    for entry in atlas():
        if entry.n_cone:
            whisker = atlas_whisker(entry.name)
            assert (whisker.length, whisker.cone_angle) == (entry.length, entry.cone_angle)
        else:
            with refusal("range", f"whisker {entry.name}") as caught:
                atlas_whisker(entry.name)
            assert caught.value.remedy == "give L and α"


@pytest.mark.parametrize("name", ["beta", "Beta", "β", "Β", " β "])
def test_greek_whiskers_have_two_spellings(name):
    assert atlas_whisker(name) == atlas_whisker("beta")


@pytest.mark.parametrize(("wrong", "near"), [("C9", "C"), ("betta", "beta"), ("F2", "2")])
def test_an_unknown_whisker_gets_the_nearest_names(wrong, near):
    with refusal("unknown", "whisker") as caught:
        atlas_whisker(wrong)
    assert near in caught.value.remedy


def test_a_name_like_no_other_is_refused_too():
    with refusal("unknown", "whisker"):
        atlas_whisker("???")


@pytest.mark.parametrize(
    ("name", "angle", "sd", "arc_mm", "base_um"),
    [("beta", 1.55, 0.20, 45.7, 142), ("C1", 1.68, 0.34, 41.9, 156), ("C2", 2.09, 0.18, 33.6, 139)],
)
def test_the_whiskers_of_the_paper_have_the_known_cones(name, angle, sd, arc_mm, base_um):
    entry = next(entry for entry in atlas() if entry.name == name)
    assert entry.cone_angle * 1e3 == pytest.approx(angle, abs=0.005)
    assert entry.cone_angle_sd * 1e3 == pytest.approx(sd, abs=0.005)
    assert entry.arc_length * 1e3 == pytest.approx(arc_mm, abs=0.051)
    assert entry.base_diameter * 1e6 == pytest.approx(base_um, abs=0.51)


def test_the_paper_range_of_cone_angles_holds_its_whiskers():
    angles = [atlas_whisker(name).cone_angle for name in ("beta", "C1", "C2")]
    assert all(abs(angle - 1.5e-3) < 2 * 4e-4 for angle in angles)  # 1.5e-3 ± 4e-4, N = 13


def source_lines(name):
    if not (SHARED / name).is_file():
        pytest.skip(f"{name} is not beside the repository")
    with open(SHARED / name, encoding="utf-8-sig", newline="") as file:
        return list(csv.reader(file))


def test_the_atlas_is_what_its_source_says():
    table = np.array([line[:16] for line in source_lines("belli2016-519-rat-whiskers.csv")[1:]], float)
    row, column, base, tip, arc, printed = table[:, [0, 1, 2, 5, 6, 12]].T
    for entry in atlas():
        here = (row == entry.row) & (column == entry.column)
        cone = here & np.isfinite(tip)
        assert (entry.n, entry.n_cone) == (here.sum(), cone.sum())
        # six digits are kept; the printed slopes have three decimals of 1e-3, so their mean agrees to 1e-5
        assert entry.arc_length == pytest.approx(arc[here].mean() * 1e-3, rel=1e-5)
        assert entry.arc_length_sd == pytest.approx(arc[here].std(ddof=1) * 1e-3, rel=1e-5)
        assert entry.base_diameter_sd == pytest.approx(base[here].std(ddof=1) * 1e-3, rel=1e-5)
        if entry.n_cone:
            lengths = arc[cone] / (1 - tip[cone] / base[cone])
            assert entry.cone_angle == pytest.approx(printed[cone].mean(), abs=1e-5)
            assert entry.length == pytest.approx(lengths.mean() * 1e-3, rel=1e-5)
            assert entry.tip == pytest.approx((tip[cone] / base[cone]).mean(), rel=1e-5)
        if entry.n_cone > 1:
            assert entry.length_sd == pytest.approx(lengths.std(ddof=1) * 1e-3, rel=1e-5)
            assert entry.cone_angle_sd == pytest.approx(printed[cone].std(ddof=1), abs=1e-5)


def test_the_isolated_whiskers_are_what_their_sources_say():
    by_name = {whisker.name: whisker for whisker in isolated_whiskers()}
    assert len(by_name) == 24
    for name, length, vibration, impulse, zeta, zeta_impulse, *_ in source_lines("hartmann2003_table2_resonance.csv")[
        1:
    ]:
        found = by_name[name]
        assert found.arc_length == pytest.approx(float(length) * 1e-3)
        measured = (found.frequency_1, found.frequency_impulse, found.damping, found.damping_impulse)
        assert measured == tuple(map(float, (vibration, impulse, zeta, zeta_impulse)))
    modes = [float(line[1]) for line in source_lines("hartmann2003_C1_modes.csv")[1:]]
    assert [by_name["C1"].frequency_1, by_name["C1"].frequency_2, by_name["C1"].frequency_3] == modes


def test_geometry_of_the_isolated_whiskers_predicts_their_resonances():
    # first root of the free cone; nothing is fitted, so the scatter of E and of the cones themselves remains
    ratios = [8.71925886 / (2 * np.pi * w.whisker.timescale) / w.frequency_1 for w in isolated_whiskers()]
    measured = np.array([ratio for ratio in ratios if np.isfinite(ratio)])
    assert measured.size == 5
    assert np.all((measured > 0.8) & (measured < 1.3))
    assert np.exp(np.log(measured).mean()) == pytest.approx(1.1, abs=0.1)


def test_three_diameters_of_real_whiskers_lie_on_a_line():
    header, *lines = source_lines("yang2019_table2_whisker_parameters.csv")
    table = [dict(zip(header, line, strict=True)) for line in lines]
    ratio, line = [], []
    for entry in table:
        distance = np.array([0, float(entry["S_prox_mm"]), float(entry["S_total_mm"])]) * 1e-3
        names = ("D_base_um", "D_medulla_termination_um", "D_tip_um")
        diameter = np.array([float(entry[name]) for name in names]) * 1e-6
        try:
            fit = from_diameters(distance, diameter)
        except InputError:  # three points are few: some whiskers cannot be told from a cylinder
            continue
        ratio.append(fit.whisker.cone_angle / ((diameter[0] - diameter[2]) / 2 / distance[2]))
        line.append(fit.r_squared)
    assert len(ratio) > 0.8 * len(table)
    assert np.median(ratio) == pytest.approx(1, abs=0.01)
    assert np.ptp(ratio) < 0.1
    assert np.median(line) > 0.998
