"""Maps: every cell is the prediction of its posture, the fold is where it is, and grey cells say why."""

import json
import threading
import time
from functools import partial

import numpy as np
import pytest
from refusals import refusal
from threadpoolctl import threadpool_limits

from vibrissa.mechanics.rod.rod_prediction import RodPrediction
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.netcdf import load
from vibrissa.sweep import maps
from vibrissa.sweep.engine import Engine
from vibrissa.sweep.grid import Grid, Measure
from vibrissa.sweep.maps import REASONS, _postures, sweep
from vibrissa.sweep.posture_cells import jumps as crossed
from vibrissa.sweep.posture_cells import linear, shaft, width_nodes
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
GAP = Gaps(position=np.zeros(1), width=np.array([1e-3]))
GRATING = Gaps(position=np.array([0.0, 1.1e-3, 2e-3, 2.9e-3]), width=np.array([5e-4, 2e-4, 7e-4, 3e-4]))
SMALL = {"contact": [0.2, 0.29, 0.4], "base_angle": [0.8, 1.2]}


def one(texture=GAP, whisker=WHISKER, speed=0.1, friction=0.4, **measure):
    """A map of a single cell."""
    contact, angle = measure.pop("contact"), measure.pop("base_angle")
    grid = Grid(contact=[contact], base_angle=[angle], speed=[speed], friction=[friction])
    return sweep(whisker, texture, grid, Measure(**measure))


def reason(contact, angle, **more):
    return REASONS[int(one(contact=contact, base_angle=angle, **more).cell_reason.squeeze())]


@pytest.mark.parametrize("response", ["exact", "linear"])
@pytest.mark.parametrize(("speed", "friction", "jump"), [(0.1, 0.4, "continuous"), (0.03, 0.2, "paper2014")])
def test_peak_is_that_of_the_prediction(response, speed, friction, jump):
    grid = Grid(**SMALL, speed=[speed], friction=[friction])
    found = sweep(WHISKER, GAP, grid, Measure(response=response, jump=jump)).peak_displacement.squeeze()
    for contact in SMALL["contact"]:
        for angle in SMALL["base_angle"]:
            posture = Posture(contact=contact, base_angle=angle, friction=friction)
            scan = Scan(speed=speed, damping=0.11, jump=jump, response=response)
            prediction = predict(WHISKER, posture, GAP, scan)
            t = np.linspace(0, 1e-3 / speed + 2 * np.pi / prediction.omega[0], 20001)
            known = np.abs(prediction.displacement(t, np.array([0.9]))).max()
            here = float(found.sel(contact=contact, base_angle=angle))
            assert here == pytest.approx(known, rel=5e-5)  # the sampling of the peak


@pytest.mark.parametrize("response", ["exact", "linear"])
def test_rms_is_that_of_the_prediction(response):
    grid = Grid(**SMALL, speed=[0.1, 0.2])
    found = sweep(WHISKER, GRATING, grid, Measure(quantity="rms", response=response)).mode_rms.squeeze()
    for contact in SMALL["contact"]:
        for speed in (0.1, 0.2):
            posture = Posture(contact=contact, base_angle=1.2)
            prediction = predict(WHISKER, posture, GRATING, Scan(speed=speed, damping=0.11, response=response))
            t = np.linspace(0, prediction.events.time[-1], 20001)
            known = prediction.mode_displacement(t)[0].std()
            here = float(found.sel(contact=contact, base_angle=1.2, speed=speed))
            assert here == pytest.approx(known, rel=2e-4)  # 20001 samples, the ends included


@pytest.mark.parametrize(("contact", "fold"), [(0.05, 1.269), (0.10, 1.378), (0.12, 1.421), (0.15, 1.486)])
def test_the_fold_is_where_the_determinant_vanishes(contact, fold):
    narrow = Gaps(position=np.zeros(1), width=np.array([1e-6]))
    assert reason(contact, fold - 0.003, texture=narrow, response="linear") == "ok"
    assert reason(contact, fold + 0.003, texture=narrow, response="linear") == "beyond the fold"


@pytest.mark.parametrize(
    ("contact", "angle", "known"), [(0.29, 1.2, (0.897, 0.813, 0.722)), (0.20, 1.4, (0.645, 0.505, 0.399))]
)
def test_exact_over_linear_jump_of_mode_1(contact, angle, known):
    for width, ratio in zip((0.0075, 0.015, 0.025), known, strict=True):
        texture = Gaps(position=np.zeros(1), width=np.array([0.04 * width]))
        for least in ({"response": "exact"}, {"response": "linear", "least_linearity": 0.0}):
            found = one(texture, contact=contact, base_angle=angle, **least).jump_linearity
            assert float(found.squeeze()) == pytest.approx(ratio, abs=6e-4)


@pytest.mark.parametrize(
    ("contact", "angle", "known"),
    [
        (0.29, 1.2, (1.234763e-4, 4.707761e-4, 1.230600e-3)),
        (0.20, 1.0, (1.627847e-4, 6.089387e-4, 1.556729e-3)),
    ],
)
def test_excursion_at_the_jump(contact, angle, known):
    postures = _postures(contact, np.array([angle]), 0.4)
    widths, many = np.array([0.0075, 0.015, 0.025]), np.empty(3)
    assert crossed(postures[0], widths, *width_nodes(), many)
    np.testing.assert_allclose(many, known, rtol=2e-6)
    single = np.empty(1)
    assert crossed(postures[0], widths[1:2], *width_nodes(), single)
    assert single[0] == pytest.approx(known[1], rel=2e-6)


@pytest.mark.parametrize(
    ("contact", "angle", "known"),
    [(0.29, 1.2, (-0.10030, 0.01904, -0.00548)), (0.20, 1.0, (-0.07328, 0.01724, -0.00582))],
)
def test_couplings(contact, angle, known):
    of, postures, found = shaft(contact, 3, 0.9), _postures(contact, np.array([angle]), 0.4), np.empty(4)
    assert linear(postures[0], of.s, of.project, found)
    np.testing.assert_allclose(found[:3], known, atol=6e-6)


def test_adimensional_maps_are_equal():
    other = Whisker(length=0.02, cone_angle=2e-3, youngs_modulus=2e9)
    pace = 0.1 / WHISKER.length * WHISKER.timescale * other.length / other.timescale
    half = Gaps(position=np.zeros(1), width=np.array([5e-4]))
    maps = [
        sweep(whisker, gap, Grid(**SMALL, speed=[speed]), Measure()).peak_displacement.values
        for whisker, gap, speed in ((WHISKER, GAP, 0.1), (other, half, pace))
    ]
    np.testing.assert_allclose(*maps, rtol=1e-6)


def test_schedulers_agree_to_the_last_digit():
    grid = Grid(contact=[0.15, 0.2, 0.29, 0.4], base_angle=[0.8, 1.2, 1.5], speed=[0.1, 0.2], friction=[0.3, 0.4])
    told = []
    with threadpool_limits(2):
        maps = [
            sweep(WHISKER, GAP, grid, Measure(), engine=engine, progress=lambda *words: told.append(words))
            for engine in (Engine(scheduler=name, workers=2) for name in ("synchronous", "threads", "processes"))
        ]
    assert maps[0].identical(maps[1])
    assert maps[0].identical(maps[2])
    assert all(done <= total for _, done, total in told)
    assert sum(done == total > 0 for _, done, total in told) == 3
    assert maps[0].peak_displacement.dims == ("friction", "speed", "contact", "base_angle")
    lone = one(contact=0.29, base_angle=1.2, speed=0.2, friction=0.3).peak_displacement.squeeze()
    assert float(maps[0].peak_displacement.sel(friction=0.3, speed=0.2, contact=0.29, base_angle=1.2)) == pytest.approx(
        float(lone), rel=1e-11
    )


@pytest.mark.parametrize("response", ["exact", "linear"])
def test_other_threads_go_on_while_a_row_is_computed(monkeypatch, response):
    """Within the compiled loops of a row this thread runs too: threads share the cores."""
    inside = []

    def row(*given):
        begin = time.perf_counter()
        compiled(*given)
        inside.append((begin, time.perf_counter()))

    compiled = maps.row
    grid = Grid(contact=np.full(1, 0.29), base_angle=np.linspace(0.8, 1.2, 300), speed=[0.02])
    work = partial(sweep, WHISKER, GAP, grid, Measure(response=response), engine=Engine(scheduler="synchronous"))
    work()  # compiles
    monkeypatch.setattr(maps, "row", row)
    worker, ticks = threading.Thread(target=work), []
    worker.start()
    while worker.is_alive():
        ticks.append(time.perf_counter())
        time.sleep(1e-4)
    begin, end = max(inside, key=lambda span: span[1] - span[0])
    assert sum(begin < tick < end for tick in ticks) > 5


def test_a_cell_without_a_value_says_why():
    grid = Grid(contact=[0.08, 0.12, 0.2, 0.4], base_angle=[0.8, 1.2, 1.45], speed=[0.1])
    blunt = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.1)
    found = sweep(blunt, GAP, grid, Measure(response="linear", least_linearity=0.6))
    words = np.array(REASONS)[found.cell_reason.values[0]]
    assert set(words[0]) == {"contact beyond the tip"}
    assert words[1, 2] == "beyond the fold"
    assert words[2, 2] == "less linear than required"
    assert words[3, 0] == "ok"
    np.testing.assert_array_equal(np.isnan(found.peak_displacement.values[0, 0]), words != "ok")
    assert int(found.cells_with_value) == (words == "ok").sum()
    assert found.cell_reason.attrs["flag_meanings"].split("; ") == list(REASONS)


def test_a_gap_too_wide_for_the_whisker_has_its_own_reason():
    wide = Gaps(position=np.zeros(1), width=np.array([0.03]))
    assert reason(0.29, 1.2, texture=wide) == "no profile follows the edges of the widest gap"


def test_a_cell_has_a_value_where_the_prediction_has():
    grid = Grid(contact=[0.09, 0.12], base_angle=np.linspace(1.22, 1.40, 7), speed=[0.1])
    found = sweep(WHISKER, GAP, grid, Measure()).cell_reason[0]
    for cell in found.stack(cell=("contact", "base_angle")).transpose():
        posture = Posture(contact=float(cell.contact), base_angle=float(cell.base_angle))
        if cell:
            with refusal("range", "gap_width"):
                predict(WHISKER, posture, GAP, Scan(speed=0.1, damping=0.11), n_modes=1)
        else:
            predict(WHISKER, posture, GAP, Scan(speed=0.1, damping=0.11), n_modes=1)
    assert set(found.values.ravel()) == {0, 1, 3}


def test_a_posture_that_no_load_gives_has_its_own_reason():
    assert reason(0.05, 1.5, friction=-0.5) == "no equilibrium"


@pytest.mark.parametrize(
    ("grid", "measure", "words"),
    [
        ({"contact": [0.3, 0.2]}, {}, ("format", "Grid.contact")),
        ({"contact": [0.3, 0.95]}, {}, ("range", "contact")),
        ({"base_angle": [1.2, 1.6]}, {}, ("range", "Posture.base_angle")),
        ({"speed": [0.0]}, {}, ("range", "Scan.speed")),
        ({"friction": [np.inf]}, {}, ("range", "Posture.friction")),
        ({}, {"quantity": "mean"}, ("unknown", "quantity")),
        ({}, {"response": "quadratic"}, ("unknown", "Scan.response")),
        ({}, {"least_linearity": 2.0}, ("range", "least linearity")),
        ({}, {"n_modes": 0}, ("range", "number of modes")),
        ({}, {"node": 0.3}, ("range", "node")),
    ],
)
def test_bad_input_is_refused(grid, measure, words):
    with refusal(*words):
        sweep(WHISKER, GAP, Grid(**({**SMALL, "speed": [0.1]} | grid)), Measure(**measure))


CONE = ("--whisker.length", "0.04", "--whisker.cone-angle", "1.5e-3")


@pytest.fixture
def gap(tmp_path):
    """One gap of 1 mm."""
    (tmp_path / "gap.csv").write_text("position,width\n0,0.001\n")
    return tmp_path / "gap.csv"


def test_the_verb_writes_the_map_and_tells_the_reasons(vibrissa, gap, tmp_path):
    where = ("--contact", "0.12:0.4:3", "--base-angle", "0.8,1.45", "--speed", "0.1")
    words = ("map", "--texture", gap, *where, *CONE, "--out", tmp_path / "map.nc", "--json")
    code, out, err = vibrissa(*words)
    assert code == 0
    verdict, reasons = err.splitlines(keepends=True)
    assert verdict.startswith("vibrissa: outside the model: free end is longer than every gap at all contacts")
    assert reasons == "vibrissa: 1 of 6 postures without a value: beyond the fold\n"
    printed, written = json.loads(out), load(tmp_path / "map.nc")
    assert printed["peak_displacement"][0][0][0][1] is None
    np.testing.assert_allclose(written.contact, [0.12, 0.26, 0.4])
    assert printed["peak_displacement"][0][0][2][0] == float(written.peak_displacement[0, 0, 2, 0])


def test_a_map_that_is_not_kept_is_told(vibrissa, gap):
    where = ("--contact", "0.3", "--base-angle", "1.0", "--speed", "0.1")
    code, _, err = vibrissa("map", "--texture", gap, *where, *CONE)
    assert code == 0
    assert err.endswith("vibrissa: the map itself is not printed: --out map.nc writes it, --json prints it\n")


def test_numbers_of_an_axis_may_stand_in_any_order(vibrissa, gap, tmp_path):
    maps = []
    for contact, angle in (("0.2,0.3,0.4", "0.8,1.0"), ("0.4:0.2:3", "1.0,0.8")):
        where = ("--contact", contact, "--base-angle", angle, "--speed", "0.1")
        assert vibrissa("map", "--texture", gap, *where, *CONE, "--out", tmp_path / "map.nc")[0] == 0
        maps.append(load(tmp_path / "map.nc"))
    np.testing.assert_allclose(maps[1].contact, [0.2, 0.3, 0.4])
    gains = [one.peak_displacement for one in maps]
    np.testing.assert_allclose(*gains, rtol=1e-10)  # linspace and the list differ in the last bit of an angle


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--contact", "0.3,0.3", "--contact must be a strictly ascending row of numbers, none twice"),
        ("--out", "none/map.nc", "--out must lie in an existing folder"),
        ("--contact", "0.1:0.4", "FIRST:LAST:HOW-MANY"),
        ("--contact", "0.1:0.4:1", "2 to 100000"),
        ("--base-angle", "0.8,1.6", "π/2"),
        ("--speed", "fast", "write --speed 100mm/s,"),
        ("--out", "map.txt", ".nc"),
    ],
)
def test_bad_words_are_one_line(vibrissa, gap, option, value, words):
    options = {"--contact": "0.2,0.3", "--base-angle": "1.0", "--speed": "0.1"} | {option: value}
    code, out, err = vibrissa("map", "--texture", gap, *(w for pair in options.items() for w in pair), *CONE)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert words in err


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_the_rms_of_a_gap_passed_within_a_period_is_that_of_fine_samples(speed):
    gap = Gaps(position=np.zeros(1), width=np.array([3e-4]))
    found = one(gap, contact=0.29, base_angle=1.2, speed=speed, quantity="rms").mode_rms
    known = predict(WHISKER, Posture(contact=0.29, base_angle=1.2), gap, Scan(speed=speed, damping=0.11))
    first, last = known.events.time[[0, -1]]
    t = first + (last - first) * (np.arange(20000) + 0.5) / 20000
    assert found.item() == pytest.approx(known.mode_displacement(t)[0].std(), rel=2e-3)


def test_the_peak_of_a_cell_by_the_rod_is_sought_after_the_gap_too():
    whisker, gap = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.285), Gaps(np.zeros(1), np.array([6e-4]))
    grid, rod = Grid(contact=[0.29], base_angle=[1.0], speed=[0.5]), Rod(step=50e-6)
    found = sweep(whisker, gap, grid, Measure(rod=rod), engine=Engine(scheduler="synchronous")).peak_displacement
    within = sweep(WHISKER, gap, grid, Measure()).peak_displacement  # no free end: a bound
    assert 0.3 * within.item() < found.item() <= within.item()


@pytest.mark.parametrize("quantity", ["rms", "peak"])
def test_a_cell_by_the_rod_is_its_scan(quantity):
    whisker = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.285)
    rod, posture = Rod(step=50e-6), Posture(contact=0.29, base_angle=1.1)
    grid = Grid(contact=[0.2, 0.29], base_angle=[1.1], speed=[0.2])
    found = sweep(whisker, GAP, grid, Measure(quantity=quantity, rod=rod), engine=Engine(scheduler="synchronous"))
    assert [REASONS[int(code)] for code in found.cell_reason.values.ravel()] == ["contact beyond the tip", "ok"]
    prediction = RodPrediction(whisker, posture, GAP, Scan(speed=0.2, damping=0.11), n_modes=1, settings=rod)
    ringing = 1 / float(prediction.resonances[0]) if quantity == "peak" else 0.0
    run = prediction.run(10_000.0, np.array([0.9]), duration=float(GAP.end[-1]) / 0.2 + ringing)
    met = run.time >= GAP.position[0] / 0.2
    motion = run.mode_displacement[0, met].std() if quantity == "rms" else np.abs(run.displacement[0, met]).max()
    value = found.mode_rms if quantity == "rms" else found.peak_displacement
    assert float(value[0, 0, 1, 0]) == pytest.approx(motion, rel=1e-12)
    assert found.attrs["model"] == "rod"
    assert found.attrs["verdict"].startswith("usable: whole whisker")
