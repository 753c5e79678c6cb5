"""Reliefs in plain tables: units that are stated, what is decided on the way, one line for whatever else there is."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.errors import InputError
from vibrissa.texture.io import holds_gaps, read_height_profile, read_texture, write_gaps, write_height_profile
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import periodic_grating

same_folder = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)  # the disk's pace

X = np.array([0.0, 1e-4, 3e-4, 6e-4])
Z = np.array([1e-6, -2e-6, 3e-6, 0.0])


def written(folder, content, name="profile.csv"):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def table(x, z, header="position_m,height_m"):
    return "\n".join([header, *(f"{a!r},{b!r}" for a, b in zip(x.tolist(), z.tolist(), strict=True)), ""])


def even_wave(n=401, length=4e-3, span=2e-6):
    """Two periods of a cosine about the middle: its mean is 0 and it leans nowhere."""
    x = np.linspace(0, length, n)
    return x, span / 2 * np.cos(4 * np.pi * (x / length - 0.5))


# what is read


@pytest.mark.parametrize(
    ("name", "content", "units"),
    [
        ("a.csv", "position_m,height_m\n0,1e-6\n1e-4,-2e-6\n3e-4,3e-6\n6e-4,0\n", {}),
        ("a.csv", "position_mm,height_um\n0,1\n0.1,-2\n0.3,3\n0.6,0\n", {}),
        ("a.csv", "# lapped glass\n\nheight_nm,position_um\n1000,0\n-2000,100\n3000,300\n0,600\n", {}),
        ("a.csv", "\ufeffposition,height\r\n0,1\r\n100,-2\r\n300,3\r\n600,0\r\n", {"x_unit": "um", "z_unit": "um"}),
        ("a.csv", "position_mm,height\n0,1\n0.1,-2\n0.3,3\n0.6,0\n", {"z_unit": "um"}),
    ],
    ids=["metres", "mm and µm", "another order", "bare names", "one bare name"],
)
def test_one_relief_has_many_spellings(tmp_path, name, content, units):
    relief = read_height_profile(written(tmp_path, content, name), **units)
    np.testing.assert_allclose(relief.position, X, rtol=1e-15)
    np.testing.assert_allclose(relief.height, Z, rtol=1e-15)


def test_names_in_quotes_are_the_same_names(tmp_path):
    x, z = even_wave()
    plain = read_height_profile(written(tmp_path, table(x, z)))
    assert read_height_profile(written(tmp_path, table(x, z, '"position_m","height_m"'))) == plain
    bare = written(tmp_path, table(x, z, '"position","height"'))
    assert read_height_profile(bare, x_unit="m", z_unit="m") == plain
    for header in ('"Distance","Height"', '"X [m]","Height [m]"', '"Position";"Height"'):  # of other programs
        content = table(x, z, header)
        content = content.replace(",", ";") if ";" in header else content
        bare = read_height_profile(written(tmp_path, content.partition("\n")[2], "bare.csv"), x_unit="m", z_unit="m")
        foreign = read_height_profile(written(tmp_path, content), x_unit="m", z_unit="m")
        np.testing.assert_allclose(foreign.height, bare.height, atol=1e-15)
    gaps = read_texture(written(tmp_path, "position_mm,width_mm\n1,0.2\n2,0.3\n", "gaps.csv"))
    assert read_texture(written(tmp_path, '"position_mm","width_mm"\n1,0.2\n2,0.3\n', "gaps.csv")) == gaps
    with refusal("conflict", "x_unit"):  # a table of gaps leaves nothing open
        read_texture(tmp_path / "gaps.csv", x_unit="mm", z_unit="mm")
    with refusal("format", "gaps.csv"):
        read_texture(written(tmp_path, '"time_s","height"\n0,1\n1,2\n', "gaps.csv"))


@pytest.mark.parametrize("split", [" ", "\t", ",", ";", "   "])
def test_two_bare_columns_begin_at_0_and_have_no_mean(tmp_path, split):
    content = "".join(
        f"{12 + x * 1e3!r}{split}{100 + z * 1e6!r}\n" for x, z in zip(X.tolist(), Z.tolist(), strict=True)
    )
    relief = read_height_profile(written(tmp_path, content, "a.txt"), x_unit="mm", z_unit="um")
    np.testing.assert_allclose(relief.position, X, atol=1e-17)
    np.testing.assert_allclose(np.diff(relief.height), np.diff(Z), atol=1e-17)
    area = ((relief.height[1:] + relief.height[:-1]) * np.diff(relief.position)).sum() / 2
    assert abs(area) < 1e-18


def test_the_example_reads_without_an_option():
    relief = read_height_profile(Path(__file__).parents[2] / "examples" / "ridges.csv")
    assert relief.position[[0, -1]].tolist() == [0.0, 0.01]
    wave = 10e-6 * (1 - np.cos(2e3 * np.pi * relief.position)) - 20e-6
    np.testing.assert_allclose(relief.height, wave, atol=0.51e-9)  # written to the nanometre


def test_an_array_is_two_bare_columns(tmp_path):
    np.save(tmp_path / "a.npy", np.stack([X, Z], axis=1))
    relief = read_height_profile(tmp_path / "a.npy", x_unit="m", z_unit="m")
    np.testing.assert_array_equal(relief.position, X)
    np.testing.assert_allclose(np.diff(relief.height), np.diff(Z), atol=1e-20)


@same_folder
@given(st.lists(st.tuples(st.floats(0, 1), st.floats(-0.01, 0.01)), min_size=2, unique_by=lambda pair: pair[0]))
def test_what_is_written_is_read_to_the_last_bit(tmp_path, points):
    position, height = np.array(sorted(points)).T
    try:
        relief = HeightProfile(position=position, height=height)
    except InputError:  # too short
        return
    write_height_profile(relief, tmp_path / "a.csv")
    if relief.length < 0.3e-3:
        return
    again = read_height_profile(tmp_path / "a.csv", level="none")
    assert again.position.tobytes() == relief.position.tobytes()
    assert again.height.tobytes() == relief.height.tobytes()


def test_walls_are_written_and_read(tmp_path):
    relief = HeightProfile.from_gaps(periodic_grating(5e-3, period=1e-3))
    write_height_profile(relief, tmp_path / "a.csv")
    assert read_height_profile(tmp_path / "a.csv").position.tobytes() == relief.position.tobytes()


def test_tables_of_gaps_are_told_from_profiles(tmp_path):
    write_gaps(periodic_grating(0.01, period=1e-3), tmp_path / "gaps.csv")
    assert holds_gaps(tmp_path / "gaps.csv")
    assert not holds_gaps(written(tmp_path, table(X, Z)))
    assert not holds_gaps(written(tmp_path, bytes(range(256))))
    with refusal("missing", "absent.csv"):
        holds_gaps(tmp_path / "absent.csv")


# what is decided: level, holes, part, direction


@pytest.mark.parametrize("tilt", [-0.02, 0.0, 0.011])
def test_levelling_gives_the_profile_before_it_was_tilted(tmp_path, tilt):
    x, z = even_wave()
    said = []
    relief = read_height_profile(written(tmp_path, table(x, z + tilt * x + 1e-4)), level="line", tell=said.append)
    np.testing.assert_allclose(relief.height, z, atol=1e-15)
    assert any(f"a tilt of {tilt * 1e3:.3g} mm per m taken away" in line for line in said) == (tilt != 0)
    assert any("no tilt to take away" in line for line in said) == (tilt == 0)


@pytest.mark.parametrize(("share", "refused"), [(0.99, False), (-0.99, False), (1.01, True), (-1.01, True)])
def test_tilt_that_rises_by_more_than_the_texture_spans_is_refused(tmp_path, share, refused):
    x, z = even_wave()
    path = written(tmp_path, table(x, z + share * np.ptp(z) / x[-1] * x))
    if not refused:
        assert read_height_profile(path).height.size == x.size
        return
    with refusal("format", "profile.csv"):
        read_height_profile(path)
    np.testing.assert_allclose(np.ptp(read_height_profile(path, level="line").height), np.ptp(z), rtol=1e-9)
    assert read_height_profile(path, level="none").height.size == x.size


AWAY = {  # mm and µm by which a table's zeros are off those of its first point and its mean
    "neither": (0, 0, []),
    "rounding": (1e-12, 1.0000001, []),
    "within the texture": (0, 0.9, []),
    "above": (0, 300, ["299 to 301 µm"]),
    "below": (0, -2000, ["-2001 to -1999 µm"]),
    "ahead": (100, 0, ["first point lies at 100 mm"]),
    "behind": (-5, 0, ["first point lies at -5 mm", "behind the contact"]),
    "both": (-5, 300, ["first point lies at -5 mm", "299 to 301 µm"]),
}


@pytest.mark.parametrize("case", AWAY)
def test_a_table_keeps_its_zeros_and_says_so_where_they_may_be_those_of_an_instrument(tmp_path, case):
    (ahead, above, words), (x, z), said = AWAY[case], even_wave(), []
    measured = x + ahead * 1e-3, z + above * 1e-6
    relief = read_height_profile(written(tmp_path, table(*measured)), tell=said.append)
    assert relief == HeightProfile(*measured)
    zeros = [line for line in said if line.startswith("zero is where the table has it")]
    assert len(zeros) == bool(words)
    assert all(word in zeros[0] for word in words)
    # without the header, with the units
    bare = table(*measured, "").removeprefix("\n")
    counted = read_height_profile(written(tmp_path, bare, "bare.csv"), x_unit="m", z_unit="m")
    np.testing.assert_allclose(counted.position, x, atol=1e-15)
    np.testing.assert_allclose(counted.height, z, atol=1e-15)


def test_a_profile_with_walls_was_drawn(tmp_path):
    x, z = np.array([1, 3, 3, 5, 5, 9]) * 1e-3, np.array([5, 5, 2, 2, 5, 5]) * 1e-5
    said = []
    read_height_profile(written(tmp_path, table(x, z)), tell=said.append, level="none")
    assert not any("zero is where" in line for line in said)


def test_zeros_that_were_taken_away_are_not_said_to_be_kept(tmp_path):
    (x, z), said = even_wave(), []
    path = written(tmp_path, table(x + 0.1, z + 3e-4))
    read_height_profile(path, level="line", part=(0, 3e-3), tell=said.append)
    read_height_profile(path, level="line", flip=True, tell=said.append)
    assert not any("zero is where" in line for line in said)
    read_height_profile(path, part=(0, 3.9e-3), level="none", tell=said.append)
    assert sum("zero is where the table has it: the heights" in line for line in said) == 1


def test_the_line_does_not_follow_where_points_are_dense(tmp_path):
    x, z = even_wave()
    dense = np.union1d(x, np.linspace(0, x[-1] / 8, 4001))  # where the wave is high
    tilted = np.interp(dense, x, z) + 0.011 * dense
    relief = read_height_profile(written(tmp_path, table(dense, tilted)), level="line")
    rest = relief.height - np.interp(dense, x, z)
    assert np.ptp(rest) < 1e-3 * np.ptp(z)  # equal weights: 1.3
    assert np.abs(np.ptp(np.polyval(np.polyfit(dense, tilted, 1) - [0.011, 0], dense))) > 0.1 * np.ptp(z)


def test_holes_are_refused_or_bridged_by_straight_lines(tmp_path):
    x, z = np.arange(11) * 1e-4, np.array([np.nan, 1, 2, np.nan, np.nan, 5, 4, 3, np.nan, 1, np.nan]) * 1e-6
    path, said = written(tmp_path, table(x, z)), []
    with refusal("format", "profile.csv"):
        read_height_profile(path)
    relief = read_height_profile(path, fill=True, tell=said.append)
    np.testing.assert_allclose(relief.position, x[1:10])
    np.testing.assert_allclose(relief.height, np.array([1, 2, 3, 4, 5, 4, 3, 2, 1]) * 1e-6)
    assert "3 points without height bridged by straight lines, 0.3 mm the widest hole" in said
    assert "2 points without height at the ends left out" in said


def test_an_empty_height_is_a_hole(tmp_path):
    with refusal("format", "profile.csv"):
        read_height_profile(written(tmp_path, "position_mm,height_um\n0,\n1,2\n2,3\n"))


@pytest.mark.parametrize("heights", ["nan nan nan nan nan", "1 nan nan nan 1"], ids=["none", "mostly holes"])
def test_a_profile_of_holes_cannot_be_filled(tmp_path, heights):
    z = np.array(heights.split(), float) * 1e-6
    with refusal("range", "profile.csv"):
        read_height_profile(written(tmp_path, table(np.arange(5) * 1e-3, z)), fill=True)


def test_a_part_begins_at_0(tmp_path):
    x, z = even_wave()
    relief = read_height_profile(written(tmp_path, table(x + 7e-3, z)), part=(1e-3 - 1e-9, 2e-3 + 1e-9), level="none")
    np.testing.assert_allclose(relief.position, x[:101], atol=1e-15)
    np.testing.assert_allclose(relief.height, z[100:201], atol=1e-15)
    with refusal("format", "profile.csv", value="a length of 0.004 m"):
        read_height_profile(tmp_path / "profile.csv", part=(5e-3, 6e-3))
    with refusal("format", "profile.csv"):
        read_height_profile(tmp_path / "profile.csv", part=(2e-3, 1e-3), level="none")


@pytest.mark.parametrize(
    ("part", "remedy"),
    [
        ((0.0, 10.0), "`part` is in metres: 0.01 for 10 mm"),
        ((0.01, 0.0302), ""),
        ((-0.001, 0.01), ""),
        ((0.0, 40.0), ""),
    ],
)
def test_a_part_that_begins_or_ends_beyond_the_surface_is_refused(tmp_path, part, remedy):
    x = np.linspace(0, 0.03, 301)
    path = written(tmp_path, table(x, 1e-5 * np.sin(2 * np.pi * x / 1e-3)))
    with refusal("format", "profile.csv", "a length of 0.03 m") as caught:
        read_height_profile(path, part=part)
    assert caught.value.remedy == remedy
    assert f"the asked part, {part[0]:g} m to {part[1]:g} m" in caught.value.rule
    assert read_height_profile(path, part=(-5e-5, 0.03005)).position.size == 301  # within a step of its ends


def test_an_empty_file_is_told_as_one(tmp_path):
    with refusal("too-few", "profile.csv", value="an empty file"):
        read_height_profile(written(tmp_path, ""))


def test_flipped_twice_is_as_it_was(tmp_path):
    path = written(tmp_path, table(X, Z))
    write_height_profile(read_height_profile(path, flip=True), tmp_path / "flipped.csv")
    flipped = read_height_profile(tmp_path / "flipped.csv")
    np.testing.assert_allclose(flipped.position, [0, 3e-4, 5e-4, 6e-4], rtol=1e-12)
    np.testing.assert_array_equal(flipped.height, Z[::-1])
    np.testing.assert_allclose(read_height_profile(tmp_path / "flipped.csv", flip=True).position, X, atol=1e-18)


def test_descending_positions_ask_for_the_direction(tmp_path):
    path = written(tmp_path, table(X[::-1], Z[::-1]))
    with refusal("range", "profile.csv"):
        read_height_profile(path)
    relief = read_height_profile(path, flip=True)
    np.testing.assert_allclose(relief.position, X)
    np.testing.assert_array_equal(relief.height, Z)


@pytest.mark.parametrize(("step", "told"), [(10e-6, False), (50e-6, True)])
def test_coarse_sampling_is_told(tmp_path, step, told):
    x = np.arange(0, 4e-3, step)
    said = []
    read_height_profile(written(tmp_path, table(x, 1e-6 * np.sin(2e3 * x))), tell=said.append)
    assert any("nothing finer than 100 µm is in the file" in line for line in said) == told


def test_heights_that_do_not_follow_one_another_are_told(tmp_path):
    noise, walk, said = np.random.default_rng(3).normal(size=400), [], []
    x = np.arange(400) * 1e-5
    read_height_profile(written(tmp_path, table(x, 1e-6 * noise)), tell=said.append)
    read_height_profile(written(tmp_path, table(x, 1e-6 * np.cumsum(noise))), level="none", tell=walk.append)
    assert any("neighbouring heights correlate by" in line for line in said)
    assert not any("correlate" in line for line in walk)


# what is refused


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("position_mm,height_um\n", ("too-few", "profile.csv")),
        ("position_mm,heigth_um\n0,1\n1,2\n", ("unknown", "profile.csv, line 1")),
        ("position_mm,height_um,height_nm\n0,1,1\n", ("missing", "profile.csv, line 1")),
        ("position_mm,width_mm\n0,1\n", ("unknown", "profile.csv, line 1")),
        ("position_mm,height_um\n0,1\n1\n", ("shape", "profile.csv, line 3")),
        ("position_mm,height_um\n0,1\n1,2,3\n", ("shape", "profile.csv, line 3")),
        ("position_mm,height_um\n0,1\n,2\n", ("format", "profile.csv, line 3, position_mm")),
        ("position_mm,height_um\nnan,1\n1,2\n", ("format", "profile.csv, line 2, position_mm")),
        ("position_mm,height_um\n0,1\n1,inf\n", ("format", "profile.csv, line 3, height_um")),
        ("position_mm,height_um\n0,1_0\n1,2\n", ("format", "profile.csv, line 2, height_um")),
        ("position,height\n0,1\n1,2\n", ("missing", "profile.csv")),
        ("position_mm,height\n0,1\n1,2\n", ("missing", "profile.csv")),
        ("position_inch,height_um\n0,1\n1,2\n", ("unknown", "profile.csv, line 1")),
        ("0,1\n1,2\n", ("missing", "profile.csv")),
        ("0 1\n1 2 3\n", ("shape", "profile.csv, line 2")),
        ("0 1\n1 high\n", ("format", "profile.csv, line 2, height")),
        ("position_mm,height_um\n0,1\n", ("too-few", "profile.csv")),
        (
            "position_mm,height_um\n0,1\n2,2\n1,3\n4,1\n",
            ("range", "profile.csv"),
        ),
        ("position_mm,height_um\n0,1\n1,2\n1,2\n2,1\n", ("format", "profile.csv: relief")),
        ("position_um,height_um\n0,1\n100,2\n200,1\n", ("too-few", "profile.csv")),
        ("position_m,height_um\n0,1\n1,2\n48,1\n", ("format", "profile.csv: relief")),
        ("position_mm,height_mm\n0,1\n1,200\n4.8,1\n", ("format", "profile.csv: relief")),
    ],
)
def test_bad_tables_are_refused_in_one_line(tmp_path, content, message):
    with refusal(*message) as refused:
        read_height_profile(written(tmp_path, content))
    assert "profile.csv" in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_a_place_twice_is_no_measurement(tmp_path):
    with refusal("range", "profile.csv"):
        read_height_profile(written(tmp_path, "0 1\n1 2\n1 3\n2 1\n"), x_unit="mm", z_unit="um")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"x_unit": "mm"}, ("conflict", "profile.csv")),
        ({"z_unit": "m"}, ("conflict", "profile.csv")),
        ({"line": "x:0"}, ("format", "profile.csv")),
        ({"level": "plane"}, ("unknown", "level")),
    ],
)
def test_options_that_contradict_the_file_are_refused(tmp_path, options, message):
    with refusal(*message):
        read_height_profile(written(tmp_path, table(X, Z)), **options)


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.zeros((3, 3)), ("shape", "a.npy")),
        (np.zeros(3), ("shape", "a.npy")),
        (np.array([[0, 1], [np.nan, 2]]), ("too-few", "a.npy")),
        (np.array([{"a": 1}], dtype=object), ("format", "a.npy")),
        (np.array([["a", "b"]]), ("shape", "a.npy")),
    ],
)
def test_bad_arrays_are_refused(tmp_path, array, message):
    np.save(tmp_path / "a.npy", array)
    with refusal(*message):
        read_height_profile(tmp_path / "a.npy", x_unit="m", z_unit="m")


@pytest.mark.parametrize("name", ["absent.csv", "absent.npy", "."])
def test_what_is_no_file_is_refused(tmp_path, name):
    with refusal("missing"):
        read_height_profile(tmp_path / name)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read all")
def test_forbidden_file_is_refused(tmp_path):
    path = written(tmp_path, table(X, Z))
    path.chmod(0)
    with refusal("format", "profile.csv") as caught:
        read_height_profile(path)
    assert caught.value.rule.startswith("could not be read")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            "Position_mm,Height_um\n0,1\n1,2\n",
            ("unknown", "profile.csv, line 1"),
        ),
        ("position_mm,height_um,valid\n0,1,1\n", ("unknown", "profile.csv, line 1")),
        (
            "position_mm;height_um\n0;1\n",
            ("format", "profile.csv, line 1"),
        ),
        ("position_mm\theight_um\n0\t1\n", ("format", "profile.csv, line 1")),
    ],
)
def test_headers_of_other_habits_are_told_what_to_write(tmp_path, content, message):
    with refusal(*message):
        read_height_profile(written(tmp_path, content))


def test_nothing_is_said_of_the_sampling_of_a_table_drawn_by_hand(tmp_path):
    said = []
    read_height_profile(
        written(tmp_path, "position_mm,height_um\n0,0\n1,0\n1,-35\n1.4,-35\n1.4,0\n3,0\n"), tell=said.append
    )
    assert said == ["6 points over 3 mm, straight lines between them"]
    said.clear()
    noise = np.random.default_rng(3).normal(size=400)
    read_height_profile(written(tmp_path, table(np.arange(400) * 1e-5, 1e-6 * noise)), tell=said.append)
    assert not any("instrument" in line for line in said)
