"""Tables of text: what is written is read to the last bit, one table of units, one line for whatever else there is."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.errors import InputError
from vibrissa.tables import text
from vibrissa.tables.reader import ANY, read_table
from vibrissa.tables.units import FACTORS, POWERS, PURE, TEXT, in_si, is_unit, spellings, to_si, unit_of, units_of
from vibrissa.tables.writer import write_table

same_folder = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)  # the disk's pace


@pytest.fixture
def file(tmp_path):
    """Write text into a file of its own."""

    def write(text):
        (tmp_path / "table.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
        return tmp_path / "table.csv"

    return write


# Units


@pytest.mark.parametrize(
    ("column", "quantity", "si", "unit"),
    [
        ("width", "width", "m", "m"),
        ("width_um", "width", "m", "um"),
        ("width_m", "width", "m", "m"),
        ("scan_speed_mm_s", "scan_speed", "m/s", "mm_s"),
        ("slope_per_um", "slope", "1/(s m)", "per_um"),
        ("cone_angle_mrad", "cone_angle", "rad", "mrad"),
        ("time_ms", "time", "s", "ms"),
        ("width_ms", "width", "m", None),  # a unit of something else
        ("width_", "width", "m", None),
        ("widths", "width", "m", None),
        ("spike_time", "time", "s", None),
        ("unit_um", "unit", TEXT, None),  # words have no unit
    ],
)
def test_the_end_of_a_name_is_its_unit(column, quantity, si, unit):
    assert unit_of(column, quantity, si) == unit


def test_every_spelling_is_read_as_what_it_says():
    for quantity, si in (("width", "m"), ("time", "s"), ("speed", "m/s"), ("angle", "rad")):
        names = spellings([(quantity, si)])
        assert len(names) == 1 + len(units_of(si))
        assert all(unit_of(name, quantity, si) in {si, *units_of(si)} for name in names)


@given(value=st.floats(-1e6, 1e6), unit=st.sampled_from(sorted(set(POWERS) - set(FACTORS))))
def test_numbers_in_si_are_nearest_to_the_decimals_written(value, unit):
    # numbers below 2e-308 have steps of 5e-324
    assert to_si(value, unit) == pytest.approx(value * float(f"1e{POWERS[unit]}"), rel=3e-16, abs=1e-323)


def test_what_is_written_in_micrometres_is_the_number_written_in_metres():
    for count in range(1, 2000):
        assert to_si(float(count), "um") == float(f"{count}e-6")


# Reading and writing

CELLS = st.text(st.characters(codec="utf-8"), min_size=1, max_size=5).filter(
    lambda cell: cell == cell.strip() and cell.isprintable()
)


@same_folder
@given(rows=st.lists(st.tuples(st.floats(allow_nan=False, allow_infinity=False), CELLS), min_size=1, max_size=9))
def test_what_is_written_is_read_to_the_last_bit(tmp_path, rows):
    numbers, words = map(list, zip(*rows, strict=True))
    write_table(tmp_path / "a.csv", {"number": np.array(numbers), "word": words})
    table = read_table(tmp_path / "a.csv", {"number": PURE, "word": TEXT})
    assert table.numbers("number").tobytes() == np.array(numbers).tobytes()
    assert table.text("word") == words


def test_lines_are_numbered_as_in_the_file(file):
    table = read_table(file('\ufeff# by hand\n\n time_ms ,"name", x\n1,a,\n # two\n\n"2.5",b, 7\n'), {"time": "s"})
    assert (table.header, list(table.lines), table.others) == (("time_ms", "name", "x"), [4, 7], ["name", "x"])
    assert table.numbers("time").tolist() == [1e-3, 2.5e-3]
    assert table.numbers("time", si=False).tolist() == [1.0, 2.5]
    assert table.text("name") == ["a", "b"]
    assert [cells["x"] for _, cells in table.rows()] == ["", "7"]
    np.testing.assert_array_equal(table.numbers("x", blanks=True), [np.nan, 7])


def test_a_header_alone_is_a_table_without_rows(file):
    table = read_table(file("time,name\n"), {"time": "s"})
    assert (len(table), table.numbers("time").size, table.text("name")) == (0, 0, [])
    with refusal("too-few", "table.csv", value="none"):
        table.refuse_empty("must have lines")


def test_tables_without_a_header_are_given_one(file):
    table = read_table(file("0 1\n# x\n1;2\n3\t4\n"), {"a": PURE, "b": PURE}, header=("a", "b"), delimiter=ANY)
    assert (table.numbers("a").tolist(), table.numbers("b").tolist()) == ([0, 1, 3], [1, 2, 4])


def test_names_in_quotes_are_the_same_names(file):
    header = ["spike_time_ms", "unit"]
    for opening in ("spike_time_ms,unit", '"spike_time_ms","unit"', 'spike_time_ms,"unit"', " spike_time_ms , unit "):
        assert text.header_names(opening) == header
        table = read_table(file(f"{opening}\n1500,a\n"), {"spike_time": "s", "unit": TEXT})
        assert (table.header, table.numbers("spike_time").tolist(), table.text("unit")) == (tuple(header), [1.5], ["a"])
    assert text.header_names("a;b\tc") == ["a", "b", "c"]
    assert text.header_names('"a;b",c', "") == ["a;b", "c"]
    assert text.header_names("") == []


def test_a_fault_in_a_long_file_is_found_on_its_line(file):
    path = file("a,b\n" + "1,2\n" * 25_000 + "1\n" + "1,2\n" * 10)
    with refusal("shape", "table.csv, line 25002") as caught:
        read_table(path, {"a": PURE})
    assert caught.value.quantity == f"{path}, line 25002"
    path = file("a,b\n" + "1,2\n" * 25_000 + "x,1\n" + "1,2\n" * 10)
    with refusal("format", "table.csv, line 25002, a") as caught:
        read_table(path, {"a": PURE}).numbers("a")
    assert (caught.value.quantity, caught.value.value) == (f"{path}, line 25002, a", "'x'")


@pytest.mark.parametrize(
    ("text", "others", "code", "place", "rule", "remedy"),
    [
        ("", True, "too-few", "", "must hold a header and a line for each row", ""),
        ("width_nm,width\n1,1\n", True, "missing", ", line 1", "must have one column width", ""),
        ("wide\n1\n", True, "missing", ", line 1", "must have a column width", "rename the column 'wide' to width"),
        (
            "Width_um\n1\n",
            True,
            "missing",
            ", line 1",
            "must have a column width",
            "rename the column 'Width_um' to width_um",
        ),
        ("Width_um\n1\n", False, "unknown", ", line 1", "has an unknown column", "did you mean width_um?"),
        (
            "width,depth\n1,1\n",
            False,
            "unknown",
            ", line 1",
            "has an unknown column",
            "columns are width, in SI or ending in ",
        ),
        (
            "width;depth\n1;1\n",
            True,
            "format",
            ", line 1",
            "must separate its columns by commas",
            "such as 'width,depth', with",
        ),
        ("width,a,a\n1,1,1\n", True, "format", ", line 1", "must name each column once", ""),
        ("width\n1\n\n1,2\n", True, "shape", ", line 4", "must have 1 cells, width", "columns are separated by commas"),
        ('width\n"1\n2\n', True, "format", ", line 2", "must close its quotes", ""),
        ("width\n1\0\n", True, "format", ", line 2, width", "must be text in printable signs", ""),
    ],
)
def test_faults_are_refused_by_file_line_and_column(file, text, others, code, place, rule, remedy):
    path = file(text)
    with refusal(code) as caught:
        read_table(path, {"width": "m"}, others=others)
    assert (caught.value.quantity, caught.value.rule) == (f"{path}{place}", rule)
    assert caught.value.remedy.startswith(remedy)


@pytest.mark.parametrize(
    ("column", "remedy"),
    [
        ("frame_rate_kHz", "name it frame_rate, in Hz"),
        ("run_no", "name it run"),
        ("friction_pct", "name it friction"),
        ("width_in", "width may be width, width_m, width_mm, "),
    ],
)
def test_a_column_in_a_unit_that_it_cannot_have_is_refused_with_the_names_it_may_have(file, column, remedy):
    with refusal("unknown") as caught:
        known = {"frame_rate": "Hz", "run": TEXT, "friction": PURE, "width": "m"}
        read_table(file(f"{column}\n1\n"), {}, known, others=False)
    assert caught.value.remedy.startswith(remedy)


@same_folder
@given(st.binary() | st.text().map(str.encode))
def test_any_bytes_are_read_or_refused_in_one_line(tmp_path, content):
    (tmp_path / "any.csv").write_bytes(content)
    try:
        table = read_table(tmp_path / "any.csv", {})
    except InputError as error:
        assert "\n" not in str(error)  # noqa: PT017
    else:
        assert all(len(table.text(name)) == len(table) for name in table.header)


def test_a_line_without_an_end_is_refused_before_it_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(text, "LONGEST", 50)
    (tmp_path / "table.csv").write_text("width\n" + "1" * 60 + "\n")
    with pytest.raises(InputError, match="line 2 must have lines of fewer than 50 characters"):
        read_table(tmp_path / "table.csv", {"width": "m"})


def test_a_line_of_too_many_cells_is_refused_before_it_is_parted(tmp_path, monkeypatch):
    monkeypatch.setattr(text, "WIDEST", 5)
    (tmp_path / "table.csv").write_text("width\n1,2,3,4,5,6\n")
    with pytest.raises(InputError, match="line 2 must have lines of at most 5 cells"):
        read_table(tmp_path / "table.csv", {"width": "m"})


def test_blank_lines_without_end_are_refused(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("position\n" + "\n" * (text.BLANK + 1) + "1\n")
    with pytest.raises(ValueError, match=r"a\.csv, line 100002 must follow at most 100,000 blank lines"):
        list(text.each_line(path))
    path.write_text("position\n" + "\n" * text.BLANK + "1\n")
    assert [number for number, _ in text.each_line(path)] == [1, text.BLANK + 2]


@pytest.mark.parametrize(
    ("text", "meant"),
    [("mm/s", (2e-3, "m/s")), ("m/s", (2.0, "m/s")), ("seconds", (2.0, "s")), ("ms", (2e-3, "s")), ("µs", (2e-6, "s"))],
)
def test_spellings_of_other_programs_are_units(text, meant):
    assert is_unit(text)
    value, unit = in_si(2.0, text)
    assert unit == meant[1]
    assert value == pytest.approx(meant[0], rel=1e-15)
