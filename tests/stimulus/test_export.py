"""Commands on disk: back again to the precision told, whole, and told apart from what is none."""

import json

import numpy as np
import pytest
from refusals import refusal
from scipy.io import wavfile

from vibrissa import __version__
from vibrissa.quantities import dataset
from vibrissa.stimulus.array import replay_command
from vibrissa.stimulus.delays import WHISKERS
from vibrissa.stimulus.export import Sound, encoded, read_command, write_command
from vibrissa.stimulus.limits import Limits
from vibrissa.stimulus.waveform import PointMotion


@pytest.fixture(scope="module")
def command():
    moved = np.random.default_rng(0).normal(0, 1e-5, 6000)
    motion = PointMotion(displacement=moved, sampling_rate=1000.0, source="noise", resonance=70.0)
    settings = {
        "duration": 5.0,
        "sampling_rate": 1000.0,
        "delays": "random",
        "seed": 4,
        "separation": 0.05,
        "ramp": 0.5,
    }
    return replay_command([motion], **settings, limits=Limits(travel=1e-3))


def peak(data):
    return float(np.abs(data.command).max())


@pytest.mark.parametrize(
    ("name", "sound", "precision"),
    [
        ("c.nc", None, 0.0),
        ("c.npy", None, 0.0),
        ("c.csv", None, 5e-9),
        ("c.wav", Sound(), 2.0**-24),
        ("c.wav", Sound(encoding="int24"), 0.5 / (2**23 - 1)),
        ("c.wav", Sound(encoding="int16"), 0.5 / (2**15 - 1)),
        ("c.WAV", Sound(encoding="int16", full_scale=1e-3), None),
    ],
)
def test_a_command_comes_back_to_the_precision_told(command, tmp_path, name, sound, precision):
    write_command(command, tmp_path / name, sound=sound)
    back = read_command(tmp_path / name)
    tolerance = 0.5e-3 / (2**15 - 1) if precision is None else precision * peak(command)
    assert np.abs(back.command.values - command.command.values).max() <= tolerance * (1 + 1e-9)
    assert back.whisker.values.tolist() == list(WHISKERS)
    np.testing.assert_allclose(back.time, command.time, atol=1e-12)
    assert back.attrs["filter"] == command.attrs["filter"]
    assert sorted(one.name for one in tmp_path.iterdir()) == [name, f"{name}.json"]


@pytest.mark.parametrize("name", ["c.nc", "c.npy", "c.csv", "c.wav"])
def test_a_command_of_one_whisker_comes_back(command, tmp_path, name):
    one = command.isel(whisker=[3])
    write_command(one, tmp_path / name)
    back = read_command(tmp_path / name)
    np.testing.assert_allclose(back.command, one.command, atol=5e-9)
    assert back.whisker.values.tolist() == one.whisker.values.tolist()


@pytest.mark.parametrize(("encoding", "kind"), [("float32", np.float32), ("int24", np.int32), ("int16", np.int16)])
def test_other_readers_see_24_channels_at_the_sampling_rate(command, tmp_path, encoding, kind):
    write_command(command, tmp_path / "c.wav", sound=Sound(encoding=encoding, full_scale=1e-4))
    rate, values = wavfile.read(tmp_path / "c.wav")
    top = {"float32": 1.0, "int24": (2**23 - 1) * 256.0, "int16": 2**15 - 1.0}[encoding]
    assert (rate, values.shape, values.dtype) == (1000, (6000, 24), np.dtype(kind))
    np.testing.assert_allclose(values.T / top * 1e-4, command.command, atol=1e-4 / (2**15 - 1))


def test_integers_are_little_endian_and_the_full_scale_is_the_largest():
    values = np.array([[1.0, -1.0, 0.0, 1 / (2**23 - 1)]])
    assert encoded(values, "int24").hex() == "ffff7f" + "010080" + "000000" + "010000"
    assert encoded(values[:, :2], "int16").hex() == "ff7f" + "0180"


def test_the_sidecar_says_what_the_file_holds(command, tmp_path):
    write_command(command, tmp_path / "c.wav")
    facts = json.loads((tmp_path / "c.wav.json").read_text())
    assert (facts["unit"], facts["sampling_rate"], facts["samples"]) == ("m", 1000.0, 6000)
    assert facts["full_scale"] == peak(command)
    assert facts["versions"]["vibrissa"] == __version__
    said = facts["attributes"]
    assert (said["seed"], said["delays"], said["limit_travel"], said["limit_speed"]) == (4, "random", 1e-3, "none")
    assert (said["filter_order"], said["filter_norm"], said["filter_causal"], said["scale"]) == (4, "mag", 1, 1.0)
    assert facts["variables"]["delay"]["values"] == command.delay.values.tolist()
    assert facts["variables"]["frequency"]["values"] == [69.0, 70.0, 83.0, 88.0, 89.0]


@pytest.mark.parametrize("name", ["c.nc", "c.npy", "c.csv", "c.wav"])
def test_equal_commands_give_equal_bytes(command, tmp_path, name):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        write_command(command, tmp_path / folder / name)
    for one in (name, f"{name}.json"):
        assert (tmp_path / "a" / one).read_bytes() == (tmp_path / "b" / one).read_bytes()


@pytest.mark.parametrize("name", ["command.npy", "command.wav", "command.csv", "command.nc"])
def test_a_flipped_bit_is_found(command, tmp_path, name):
    write_command(command, tmp_path / name)
    whole = (tmp_path / name).read_bytes()
    for place in np.random.default_rng(0).choice(len(whole) - 200, 20, replace=False):
        damaged = bytearray(whole)
        damaged[place] ^= 1
        (tmp_path / name).write_bytes(damaged)
        with refusal("format", name):
            read_command(tmp_path / name)


def test_what_a_format_cannot_hold_is_refused_and_nothing_is_written(command, tmp_path):
    with refusal("range", "command"):
        write_command(command, tmp_path / "c.wav", sound=Sound(full_scale=1e-6))
    odd = command.assign_coords(time=("time", command.time.values / 1.0001, command.time.attrs))
    with refusal("range", "sampling_rate"):
        write_command(odd, tmp_path / "c.wav")
    with refusal("format", "c.mat", value="'.mat'"):
        write_command(command, tmp_path / "c.mat")
    for value in (0.0, np.nan):
        still = command.assign(command=command.command.copy(data=np.full_like(command.command, value)))
        with refusal("range", "command"):
            write_command(still, tmp_path / "c.wav")
    with refusal("missing", "no"):
        write_command(command, tmp_path / "no" / "c.npy")
    with refusal("missing", "variable 'command'"):
        write_command(dataset(time=[0.0]), tmp_path / "c.npy")
    assert list(tmp_path.iterdir()) == []


def test_files_that_are_no_commands_are_refused(command, tmp_path):
    write_command(command, tmp_path / "c.npy")
    facts = json.loads((tmp_path / "c.npy.json").read_text("utf-8"))
    del facts["sha256"]  # as one does who has changed the command
    (tmp_path / "c.npy.json").write_text(json.dumps(facts), "utf-8")
    np.save(tmp_path / "c.npy", np.zeros((24, 7)))
    with refusal("too-few", "c.npy"):
        read_command(tmp_path / "c.npy")
    (tmp_path / "c.npy").write_bytes(b"nothing")
    with refusal("format", "c.npy"):
        read_command(tmp_path / "c.npy")
    (tmp_path / "c.npy.json").write_text("{}")
    with refusal("format", "c.npy.json"):
        read_command(tmp_path / "c.npy")
    (tmp_path / "c.npy.json").unlink()
    with refusal("missing", "c.npy.json"):
        read_command(tmp_path / "c.npy")


@pytest.mark.parametrize(
    ("values", "words"),
    [({"encoding": "int8"}, ("unknown", "encoding")), ({"full_scale": 0.0}, ("range", "full_scale"))],
)
def test_sounds_that_are_none_are_refused(values, words):
    with refusal(*words):
        Sound(**values)
