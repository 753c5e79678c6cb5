from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.errors import InputError
from vibrissa.video.io.movie import open_movie, read_blocks

HEADER = {
    "Date": "2026/3/14",
    "Camera Type": "FASTCAM SA3 model 120K-M2",
    "Record Rate(fps)": "5000",
    "Shutter Speed(s)": "1/10000",
    "Original Total Frame": "5457",
    "Total Frame": "9",
    "Image Width": "24",
    "Image Height": "16",
    "Color Type": "Mono",
    "Color Bit": "8",
    "File Format": "MRaw",
    "EffectiveBit Depth": "8",
    "EffectiveBit Side": "Lower",
    "Comment Text": "row C : whisker 1",
}

XML = """<?xml version="1.0" encoding="UTF-8"?>
<cih>
 <fileInfo><date>2026/3/14</date></fileInfo>
 <deviceInfo><deviceName>FASTCAM Mini AX200</deviceName></deviceInfo>
 <recordInfo><recordRate>{rate}</recordRate><shutterSpeed>10000</shutterSpeed></recordInfo>
 <frameInfo><totalFrame>{count}</totalFrame><recordedFrame>{count}</recordedFrame></frameInfo>
 <imageFileInfo><fileFormat>MRaw</fileFormat></imageFileInfo>
 <imageDataInfo>
  <resolution><width>{width}</width><height>{height}</height></resolution>
  <colorInfo><type>Mono</type><bit>{stored}</bit></colorInfo>
  <effectiveBit><depth>{bits}</depth><side>{side}</side></effectiveBit>
 </imageDataInfo>
</cih>"""


def levels(bits: int, count: int = 9, height: int = 16, width: int = 24) -> np.ndarray:
    drawn = np.random.default_rng(3).integers(0, 2**bits, (count, height, width))
    return drawn.astype(np.uint8 if bits == 8 else np.uint16)


def pack(values: np.ndarray, stored: int, shift: int = 0) -> bytes:
    """The bytes of frames, bit for bit: 12 bits as a string of binary digits, the highest first."""
    if stored == 12:
        digits = "".join(f"{value:012b}" for value in values.ravel())
        return int(digits, 2).to_bytes(len(digits) // 8, "big")
    return (values.astype(int) << shift).astype("<u2" if stored == 16 else "u1").tobytes()


def save(folder: Path, values: np.ndarray, stored: int, *, shift: int = 0, **changes: str) -> Path:
    said = HEADER | {"Color Bit": str(stored), "EffectiveBit Depth": str(stored)}
    count, height, width = values.shape
    said |= {"Total Frame": str(count), "Image Width": str(width), "Image Height": str(height)}
    said |= {key.replace("_", " "): value for key, value in changes.items()}
    lines = "\n".join(f"{key} : {value}" for key, value in said.items())
    (folder / "run1.cih").write_text(f"#Camera Information Header\n{lines}\n\nEND\n")
    (folder / "run1.mraw").write_bytes(pack(values, stored, shift))
    return folder / "run1.cih"


def read_or_told(path: Path) -> np.ndarray | str:
    """The frames, or the one line that says why not."""
    try:
        return np.concatenate(list(read_blocks(path)))
    except InputError as error:
        told = str(error)
    assert "\n" not in told
    return told


@pytest.mark.parametrize("name", ["run1.cih", "run1.mraw"])
@pytest.mark.parametrize("bits", [8, 12, 16])
def test_frames_are_read_to_the_bit_whichever_file_is_given(tmp_path, bits, name):
    written = levels(bits)
    save(tmp_path, written, bits)
    blocks = list(read_blocks(tmp_path / name, 4))
    assert [len(block) for block in blocks] == [4, 4, 1]
    np.testing.assert_array_equal(np.concatenate(blocks), written)
    movie = open_movie(tmp_path / name)
    assert (movie.width, movie.height, movie.bits, movie.frame_count) == (24, 16, bits, 9)
    assert (movie.codec, movie.lossy, movie.dtype) == ("mraw", False, written.dtype)


def test_the_header_knows_the_frame_rate_of_the_acquisition(tmp_path):
    movie = open_movie(save(tmp_path, levels(8), 8))
    assert movie.frame_rate == 5000
    assert np.isnan(movie.playback_rate)


def test_xml_header_says_the_same(tmp_path):
    written = levels(12)
    (tmp_path / "run1.mraw").write_bytes(pack(written, 12))
    text = XML.format(rate=6400, count=9, width=24, height=16, stored=12, bits=12, side="Lower")
    # the camera's own software writes binary settings about the XML
    (tmp_path / "run1.cihx").write_bytes(b"\0\1\xff" + text.encode() + b"\0\xfe")
    np.testing.assert_array_equal(next(read_blocks(tmp_path / "run1.cihx")), written)
    assert open_movie(tmp_path / "run1.mraw").frame_rate == 6400


@pytest.mark.parametrize(("side", "shift"), [("Lower", 0), ("Higher", 4)])
def test_effective_bits_are_those_on_the_told_side(tmp_path, side, shift):
    written = levels(12)
    path = save(tmp_path, written, 16, shift=shift, EffectiveBit_Depth="12", EffectiveBit_Side=side)
    (block,) = read_blocks(path)
    np.testing.assert_array_equal(block, written)
    assert open_movie(path).bits == 12


def test_eight_effective_bits_of_sixteen_are_uint8(tmp_path):
    written = levels(8)
    path = save(tmp_path, written, 16, EffectiveBit_Depth="8")
    (block,) = read_blocks(path)
    np.testing.assert_array_equal(block, written)
    assert block.dtype == np.uint8 == open_movie(path).dtype


def test_keys_without_spaces_about_the_colon_and_capital_suffixes_are_read(tmp_path):
    written = levels(8)
    path = save(tmp_path, written, 8)
    path.write_text(path.read_text().replace(" : ", ":"))
    path.rename(tmp_path / "run1.CIH")
    (tmp_path / "run1.mraw").rename(tmp_path / "run1.MRAW")
    np.testing.assert_array_equal(next(read_blocks(tmp_path / "run1.MRAW")), written)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"Color_Type": "Color"}, ("format", "run1.cih")),
        ({"Color_Bit": "24"}, ("format", "run1.cih")),
        ({"EffectiveBit_Depth": "14"}, ("format", "run1.cih")),
        ({"EffectiveBit_Side": "Middle"}, ("format", "run1.cih")),
        ({"File_Format": "AVI"}, ("format", "run1.cih")),
        ({"Image_Width": "0"}, ("format", "run1.cih")),
        ({"Image_Height": "-16"}, ("format", "run1.cih")),
        ({"Image_Height": "1e9"}, ("format", "run1.cih")),
        ({"Image_Width": "999999999"}, ("format", "run1.mraw")),
        ({"Total_Frame": "10"}, ("format", "run1.mraw")),
        ({"Total_Frame": "8"}, ("format", "run1.mraw")),
        ({"Record_Rate(fps)": "0"}, ("format", "run1.cih")),
        ({"Record_Rate(fps)": "fast"}, ("format", "run1.cih")),
        ({"Record_Rate(fps)": "nan"}, ("format", "run1.cih")),
    ],
)
def test_header_that_does_not_hold_is_one_line(tmp_path, changes, message):
    path = save(tmp_path, levels(8), 8, **changes)
    with refusal(*message) as error:
        open_movie(path)
    assert "\n" not in str(error.value)


def test_grey_level_above_the_effective_bits_is_an_error(tmp_path):
    written = levels(12)
    written[5, 3, 3] = 4096
    path = save(tmp_path, written, 16, EffectiveBit_Depth="12")
    with refusal("shape", "run1.mraw", value="4096"):
        list(read_blocks(path))


def test_one_file_without_the_other_is_an_error(tmp_path):
    path = save(tmp_path, levels(8), 8)
    (tmp_path / "run1.mraw").rename(tmp_path / "run2.mraw")
    with refusal("missing", "run1.cih"):
        open_movie(path)
    with refusal("missing", "run2.mraw"):
        open_movie(tmp_path / "run2.mraw")


@pytest.mark.parametrize("name", ["run1.cih", "run1.mraw"])
def test_another_movie_whose_name_begins_alike_is_left_alone(tmp_path, name):
    other = levels(8)[::-1]
    for file in (path := save(tmp_path, other, 8, Record_Rate="2000")), path.with_suffix(".mraw"):
        file.rename(file.with_stem("run1.second"))
    save(tmp_path, levels(8), 8)
    np.testing.assert_array_equal(np.concatenate(list(read_blocks(tmp_path / name))), levels(8))
    assert open_movie(tmp_path / name).frame_rate == 5000
    (tmp_path / "run1.mraw").unlink()
    with refusal("missing", "run1.cih"):
        open_movie(tmp_path / "run1.cih")


@settings(deadline=None, max_examples=300)
@given(content=st.binary(max_size=400), xml=st.booleans())
def test_any_bytes_as_header_are_one_line(tmp_path_factory, content, xml):
    folder = tmp_path_factory.mktemp("fuzz")
    (folder / "run1.mraw").write_bytes(b"\0" * 100)
    path = folder / ("run1.cihx" if xml else "run1.cih")
    path.write_bytes(b"<cih>" + content + b"</cih>" if xml else content)
    with pytest.raises(InputError) as error:
        open_movie(path)
    assert error.value.quantity == str(path)
    assert "\n" not in str(error.value)


@settings(deadline=None, max_examples=300)
@given(data=st.data())
def test_header_with_a_key_changed_is_one_line_or_read(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("fuzz")
    key = data.draw(st.sampled_from(sorted(HEADER)))
    value = data.draw(st.text(max_size=12) | st.integers().map(str) | st.floats().map(str))
    path = save(folder, levels(8), 8)
    text = "\n".join(f"{k} : {value if k == key else v}" for k, v in HEADER.items())
    path.write_text(text, encoding="utf-8", errors="replace")
    read = read_or_told(path)
    if not isinstance(read, str):
        np.testing.assert_array_equal(read, levels(8))


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_every_length_but_the_whole_is_an_error(tmp_path, bits):
    path = save(tmp_path, levels(bits, 2, 4, 6), bits)
    whole = (tmp_path / "run1.mraw").read_bytes()
    for length in range(len(whole)):
        (tmp_path / "run1.mraw").write_bytes(whole[:length])
        with refusal("format", "run1.mraw"):
            open_movie(path)


def test_header_cut_anywhere_is_one_line_or_read(tmp_path):
    path = save(tmp_path, levels(8), 8)
    whole = path.read_bytes()
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        read = read_or_told(path)
        if not isinstance(read, str):
            np.testing.assert_array_equal(read, levels(8))
