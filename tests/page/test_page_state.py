"""What the page is told: numbers in their bounds, known choices, and one line for all else."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.errors import InputError
from vibrissa.page.panel.controls import CONTROLS
from vibrissa.page.panel.state import read_state

NUMBERS = [name for name, one in CONTROLS.items() if not one.choices and not isinstance(one.default, str)]
HOSTILE = [math.nan, math.inf, -math.inf, 1e308, -1e308, 10**400, "nan", "1e308", "1_0", "", "x" * 10_000_000, True]
HOSTILE += [None, [1], {"a": 1}, "0x10", "１２x", "../../etc/passwd", "<script>"]


def test_every_default_is_within_its_own_bounds_and_makes_a_posture():
    state = read_state({})
    assert state.whisker.length == pytest.approx(0.04)
    assert state.posture.base_angle == pytest.approx(1.2)
    assert state.texture("a") != state.texture("b")


@pytest.mark.parametrize("name", NUMBERS)
def test_what_is_no_number_within_bounds_is_one_short_line_that_names_the_control(name):
    for value in HOSTILE:
        with refusal("range") as told:
            read_state({name: value})
        line = str(told.value)
        assert name in line
        assert "\n" not in line
        assert len(line) < 300


@pytest.mark.parametrize("name", NUMBERS)
def test_both_bounds_count_as_within_and_nothing_beyond(name):
    one = CONTROLS[name]
    for value in (one.low, one.high, str(one.low)):
        assert read_state({name: value}).number(name) == float(value)
    for beyond in (one.low - max(abs(one.low), 1) * 1e-6, one.high * (1 + 1e-6)):
        with refusal("range"):
            read_state({name: beyond})


@given(name=st.sampled_from([*CONTROLS, "nonsense"]), value=st.one_of(st.text(), st.integers(), st.floats(), st.none()))
def test_whatever_is_said_gives_a_state_or_one_line(name, value):
    said = ""
    try:
        assert read_state({name: value}) is not None
    except InputError as error:
        said = str(error)
    assert "\n" not in said


@pytest.mark.parametrize(
    ("given_", "told"),
    [
        ({"whisker": "C22"}, ("unknown", "Whisker, Whisker (whisker)")),
        ({"dampling": 0.1}, ("unknown", "control 'dampling'")),
        ({"a.file": "../../etc/passwd"}, ("unknown", "Texture A, File (a.file)")),
        ({"a.seed": 1.5}, ("range", "Texture A, Seed (a.seed)")),
        ({"height": 0.2}, ("range", "Posture, Distance H (height)")),
        ({"x" * 10_000_000: 1}, ("unknown", "control 'xxxxxxxxxxxx...xxxxxxxxxxxxx'")),
    ],
)
def test_the_line_names_the_remedy(given_, told):
    with refusal(*told) as error:
        read_state(given_)
    assert len(str(error.value)) < 300


def test_a_height_out_of_reach_tells_the_reach_in_millimetres():
    reach = 0.04 * np.sin(1.2)
    with refusal("range", "Posture, Distance H (height)", value="50 mm"):
        _ = read_state({"height": 0.05}).posture
    assert 0 < read_state({"height": 0.999 * reach}).posture.contact < 0.05


def test_the_contact_may_be_given_instead_of_the_height():
    assert read_state({"hold": "contact", "contact": 0.4}).posture.contact == 0.4
