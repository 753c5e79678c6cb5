"""Every reader of files, with a whole file for each format: what fuzzing changes, and what then reads it."""

import json
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from instrument_files import MAPS, REAL, hfm

READERS: dict[str, "Reader"] = {}
LAZY: set[str] = set()  # modules of readers


class Reader(NamedTuple):
    """A function that writes a whole file into a folder and gives its path, one that reads it, and how often."""

    make: Callable[[Path], Path]
    read: Callable[[Path], Any]
    cases: int
    text: bool


def reader(name: str, read: Callable[[Path], Any], cases: int = 40, text: bool = False) -> Callable[..., Any]:
    """Enter a maker of whole files, and what reads them."""

    def enter(make: Callable[[Path], Path]) -> Callable[[Path], Path]:
        READERS[name] = Reader(make, read, cases, text)
        return make

    return enter


def table(name: str, file: str, content: str, read: Callable[[Path], Any], cases: int = 40) -> None:
    """Enter a text file."""

    def make(folder: Path) -> Path:
        (folder / file).write_text(content, encoding="utf-8")
        return folder / file

    READERS[name] = Reader(make, read, cases, True)


def rows(header: str, *columns: Any) -> str:
    """Comma-separated values below a header."""
    return "\n".join([header, *(",".join(map(str, row)) for row in zip(*columns, strict=True)), ""])


def lazily(module: str, name: str, *args: Any, **how: Any) -> Callable[[Path], Any]:
    """A function that is imported when it first reads, or with all others by ``import_readers``."""
    LAZY.add(f"vibrissa.{module}")

    def read(path: Path) -> Any:
        return getattr(import_module(f"vibrissa.{module}"), name)(path, *args, **how)

    return read


def import_readers() -> None:
    """Import what reads once, before processes are forked that would each do it anew."""
    for module in sorted(LAZY):
        import_module(module)


# Tables

K = np.arange(12)
table(
    "gaps", "a.csv", rows("position_mm,width_um", K + 1, 300 + 10 * K), lazily("texture.io", "read_texture"), cases=80
)
table(
    "heights",
    "a.csv",
    rows("position_mm,height_um", np.arange(60) / 50, np.round(5 * np.sin(np.arange(60)), 3)),
    lazily("texture.io", "read_texture"),
    cases=80,
)
table(
    "heights without units",
    "a.txt",
    "".join(f"{k / 1e5} {k % 7}e-6\n" for k in range(60)),
    lazily("texture.io", "read_height_profile", x_unit="m", z_unit="m"),
    cases=80,
)
table(
    "diameters",
    "a.csv",
    rows("distance_mm,diameter_um", 3 * K, 120 - 9 * K),
    lazily("whisker.diameters", "read_diameters"),
)
table("curvature", "a.csv", rows("distance_mm,curvature", 3 * K, 1 + K), lazily("whisker.curvature", "read_curvature"))
table("shape", "a.csv", rows("x_mm,y_mm", 3 * K, 0.02 * K**2), lazily("whisker.curvature", "read_curvature"))
table(
    "posture path",
    "a.csv",
    rows("time,base_angle,contact", K / 100, 1.2 - K / 400, 0.29 + K / 1000),
    lazily("mechanics.whisking.posture_path", "read_posture_path"),
)
table(
    "base path",
    "a.csv",
    rows("time,base_angle,base_distance,travel", K / 100, 1.2 - K / 400, 0.5 + K / 1e3, K / 1e3),
    lazily("mechanics.whisking.base_path", "read_base_path"),
)
table(
    "spikes",
    "a.csv",
    rows("unit,trial,spike_time", [f"u{k % 3}" for k in K], K % 4, K / 10),
    lazily("neural.io.tables.spike_csv", "read_spikes"),
    cases=80,
)
table(
    "trials", "a.csv", rows("start,stop,stimulus", K, K + 0.5, K % 2), lazily("neural.io.tables.trials", "read_trials")
)
table("textures", "a.csv", rows("trial,texture", K, K % 2), lazily("neural.io.tables.textures", "read_textures"))
table(
    "units",
    "a.csv",
    rows("unit,threshold_um,slope_per_um,baseline,latency_ms", K, 5 + K, 2 + K, 3 + K, 9 + K),
    lazily("neural.simulated.driven", "read_driven"),
)
TIMES = np.round(np.arange(120) / 2000, 6)
table(
    "stimulus",
    "a.csv",
    rows("time,displacement_um", TIMES, np.round(9 * np.sin(np.arange(120)), 3)),
    lazily("neural.io.tables.stimulus_csv", "read_stimulus_csv"),
    cases=80,
)
table(
    "motion",
    "a.csv",
    rows("time,displacement_um", TIMES, np.arange(120) % 9),
    lazily("stimulus.waveform", "read_motion"),
)
table(
    "sensor",
    "a.csv",
    rows("time,moment", TIMES, np.arange(120) % 9),
    lazily(
        "mechanics.sensor.base_signal", "read_base_signal", kind="moment", unit="V", calibration=1.0, column="moment"
    ),
)
table(
    "sweeps",
    "a.csv",
    rows(
        "track,animal,whisker,texture,scan_speed_mm_s,run",
        ["a.nc"] * 12,
        ["rat"] * 12,
        ["C2"] * 12,
        ["unknown"] * 12,
        90 + K,
        K,
    ),
    lazily("study.spec.recorded_sweeps", "read_sweeps"),
)
table(
    "animals",
    "a.csv",
    "animal,subject,age,sex\nrat 1,R1,P90D,F\nrat 2,R2,P80D,M\n",
    lazily("study.archive.export_session", "read_animals"),
)
table(
    "marks",
    "a.csv",
    rows("frame,column,row,whisker", K, 10 + K, 20 + K, ["C1", "C2"] * 6),
    lambda path: _marks(path),
)
table(
    "head table",
    "a.csv",
    rows("frame,column,row,angle_deg", K, 10 + K, 20 + K, 3 * K),
    lazily("video.foreign.head_points", "read_head", 12),
)
DLC = "scorer,a,a,a,a,a,a\nbodyparts,base,base,base,tip,tip,tip\ncoords,x,y,likelihood,x,y,likelihood\n" + "".join(
    f"{k},{k % 7 + 3},{k % 5 + 3},0.9,{k % 3 + 40},{k % 4 + 9},0.9\n" for k in range(12)
)
table("head of DeepLabCut", "a.csv", DLC, lazily("video.foreign.head_points", "read_head", 12))
table("tracks of DeepLabCut", "a.csv", DLC, lambda path: _tracks(path))


def _marks(path: Path) -> Any:
    from vibrissa.cli.movies.points import marks_of

    return marks_of(None, path)


def _tracks(path: Path, **how: Any) -> Any:
    from vibrissa.video.foreign.tracks import read_tracks
    from vibrissa.video.tracking import Calibration

    return read_tracks(path, Calibration(frame_rate=500.0, pixel_size=1e-4), **how)


# Studies, edits, states of the page

STUDY = """name = "a"
[whisker]
length = 0.04
cone_angle = 1.5e-3
[posture]
contact = 0.29
base_angle = 1.2
[scan]
speed = 0.1
damping = 0.11
[texture]
length = 0.02
seed = 1
[film]
n_frames = 20
subframes = 2
camera = { frame_rate = 2000.0, pixel_size = 2e-4, width = 220, height = 80 }
[recording]
n_trials = 5
unit = { threshold = 8e-6, slope = 2.5e6, baseline = 5.0, latency = 0.012 }
"""
table("study", "a.toml", STUDY, lazily("study.spec.settings", "read_study"), cases=80)
MOVIE = {"name": "m.mkv", "frames": 60, "width": 100, "height": 80}
EDITS = [
    {"do": "name", "at": [3, 1.5, 2.5], "whisker": 0, "whole": True},
    {"do": "swap", "frame": 5, "whiskers": [0, 1]},
    {"do": "join", "at": [1, 2, 3], "to": [4, 5, 6]},
]
table(
    "edits",
    "a.edits.json",
    json.dumps({"format": "vibrissa edits", "version": 2, "movie": MOVIE, "edits": EDITS}, indent=1),
    lambda path: _edits(path),
    cases=80,
)
table(
    "state of the page",
    "a.json",
    json.dumps({"contact": 0.29, "base_angle": 1.2, "length": 0.04, "speed": 0.1, "a.length": 0.02}, indent=1),
    lambda path: _state(path),
    cases=80,
)


def _edits(path: Path) -> Any:
    from vibrissa.video.correct.edit_file import EditedMovie, read_edits

    return read_edits(path, EditedMovie(**MOVIE))


def _state(path: Path) -> Any:
    from vibrissa.page.panel.state import read_state

    try:
        given = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        return None
    return read_state(given) if isinstance(given, dict) else None


# Datasets and commands


def tracks() -> Any:
    """A small profile."""
    from vibrissa.quantities import dataset

    t, s = np.arange(12) / 500, np.linspace(0, 0.02, 6)
    x, y = np.broadcast_to(s, (12, 6)), np.random.default_rng(1).normal(size=(12, 6))
    return dataset({"frame": "image"}, time=t, node=np.arange(6), x=x, y=y, arc_length=s)


@reader("dataset", lazily("netcdf", "load"), cases=80)
def whole_dataset(folder: Path) -> Path:
    from vibrissa.netcdf import save

    save(tracks(), folder / "a.nc")
    return folder / "a.nc"


@reader("dataset of another program", lazily("netcdf", "load"), cases=40)  # a process for each
def foreign_dataset(folder: Path) -> Path:
    tracks().to_netcdf(folder / "a.nc", engine="h5netcdf")
    return folder / "a.nc"


def command(folder: Path, name: str) -> Path:
    """A command of one whisker, with its sidecar."""
    from vibrissa.quantities import dataset
    from vibrissa.stimulus.export import write_command

    time = np.arange(400) / 2000
    motion = 1e-5 * np.sin(300 * time)[None]
    data = dataset({"sampling_rate": 2000.0}, whisker=np.array(["C2"]), time=time, command=motion)
    write_command(data, folder / name)
    return folder / name


for suffix in (".wav", ".npy", ".csv", ".nc"):

    @reader(f"command {suffix}", lazily("stimulus.export", "read_command"), text=suffix == ".csv")
    def whole_command(folder: Path, suffix: str = suffix) -> Path:
        return command(folder, f"a{suffix}")


@reader("command's sidecar", lambda path: _command_beside(path), cases=80, text=True)
def sidecar(folder: Path) -> Path:
    command(folder, "a.wav")
    return folder / "a.wav.json"


def _command_beside(path: Path) -> Any:
    return lazily("stimulus.export", "read_command")(path.with_suffix(""))


SOUND = {"kind": "moment", "unit": "full scale", "calibration": 1.0}


@reader("sound", lazily("mechanics.sensor.base_signal", "read_base_signal", **SOUND), cases=80)
def sound(folder: Path) -> Path:
    from scipy.io import wavfile

    wavfile.write(folder / "a.wav", 2000, (1e4 * np.sin(np.arange(300) / 3)).astype(np.int16))
    return folder / "a.wav"


# Instruments


@reader("array of heights", lazily("texture.io", "read_height_profile", x_unit="m", z_unit="m"))
def heights(folder: Path) -> Path:
    np.save(folder / "a.npy", np.c_[np.arange(90) * 1e-5, 1e-6 * (np.arange(90) % 7)])
    return folder / "a.npy"


@reader("x3p", lazily("texture.io", "read_height_profile", line="x:1"))
def x3p(folder: Path) -> Path:
    from bombs import x3p_bomb

    return x3p_bomb(folder / "a.x3p", 400)


@reader("sdf", lazily("texture.io", "read_height_profile", line="x:1"), text=True)
def sdf(folder: Path) -> Path:
    keys = {
        "ManufacID": "a",
        "CreateDate": "010120001200",
        "ModDate": "010120001200",
        "NumPoints": 60,
        "NumProfiles": 3,
    }
    keys |= {"Xscale": "1e-5", "Yscale": "1e-5", "Zscale": "1e-8", "Zresolution": -1, "Compression": 0}
    keys |= {"DataType": 7, "CheckType": 0}
    head = "".join(f"{key} = {value}\n" for key, value in keys.items())
    body = "\n".join(" ".join(str((7 * k + j) % 11) for k in range(60)) for j in range(3))
    (folder / "a.sdf").write_text(f"aISO-1.0\n{head}*\n{body}\n*\n")
    return folder / "a.sdf"


for maker in MAPS:

    @reader(f"map .{maker}", lazily("texture.io", "read_height_profile", line="x:1"), cases=40)
    def map_of_heights(folder: Path, maker: str = maker) -> Path:
        (folder / f"a.{maker}").write_bytes(MAPS[maker]())
        return folder / f"a.{maker}"


@reader("profile .hfm", lazily("texture.io", "read_height_profile", level="line"), text=True)
def profile_of_heights(folder: Path) -> Path:
    (folder / "a.hfm").write_bytes(hfm())
    return folder / "a.hfm"


for one in ("frt-2.frt", "opdx-3.opdx", "stp-1.stp"):
    if (REAL / one).is_file():

        @reader(f"real {one}", lambda path: _heights(path), cases=12)
        def real_map(folder: Path, one: str = one) -> Path:
            (folder / one).write_bytes((REAL / one).read_bytes())
            return folder / one


def _heights(path: Path) -> Any:
    """Heights of a map, also of one that is too small for a whisker."""
    from vibrissa.texture import topography

    return topography._heights(topography._opened(path)[0])


# Spikes of other programs


@reader("NWB", lazily("neural.io.formats.nwb", "read_nwb"), cases=16)
def nwb(folder: Path) -> Path:
    import datetime
    import warnings

    import pynwb

    start = datetime.datetime(2024, 1, 1, tzinfo=datetime.UTC)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        file = pynwb.NWBFile(session_description="a", identifier="a", session_start_time=start)
        for unit in range(2):
            file.add_unit(spike_times=np.arange(20.0) + unit / 10)
        series = pynwb.TimeSeries(name="a", data=np.sin(np.arange(400.0)), unit="m", rate=1000.0)
        file.add_stimulus(series)
        for trial in range(4):
            file.add_trial(start_time=4.0 * trial, stop_time=4.0 * trial + 4)
        with pynwb.NWBHDF5IO(folder / "a.nwb", "w") as io:
            io.write(file)
    return folder / "a.nwb"


READERS["trials of NWB"] = Reader(nwb, lazily("neural.io.formats.nwb", "read_nwb_trials"), 8, False)
READERS["series of NWB"] = Reader(nwb, lazily("neural.io.formats.nwb_series", "read_nwb_stimulus"), 8, False)


@reader("Plexon", lazily("neural.io.formats.plexon", "read_plexon"), cases=40)
def plexon(folder: Path) -> Path:
    from plexon_files import write_plx

    return write_plx(folder / "a.plx", {(1, 1): [100, 900], (2, 1): [300]}, {"Start": [(0, 0), (500, 0)]})


@reader("NeuroExplorer", lazily("neural.io.formats.plexon", "read_plexon"), cases=40)
def nex(folder: Path) -> Path:
    from plexon_files import write_nex

    return write_nex(folder / "a.nex", {"a": [10, 20, 900], "b_wf": [15]}, {"start": [0, 500]})


for one in ("spike_times.npy", "spike_clusters.npy", "params.py", "cluster_group.tsv"):

    @reader(f"phy, {one}", lambda path: lazily("neural.io.formats.phy", "read_phy")(path.parent), text=one[-1] != "y")
    def phy(folder: Path, one: str = one) -> Path:
        clusters = np.tile([3, 5, 8, 9], 2)
        np.save(folder / "spike_times.npy", (30 * clusters + np.repeat([0, 30000], 4)).astype(np.uint64)[:, None])
        np.save(folder / "spike_clusters.npy", clusters.astype(np.int32))
        (folder / "params.py").write_text("n_channels_dat = 8\ndtype = 'int16'\noffset = 0\nsample_rate = 30000.\n")
        (folder / "cluster_group.tsv").write_text("cluster_id\tgroup\n3\tgood\n5\tmua\n8\tnoise\n")
        return folder / one


def sorted_folder(path: Path) -> Any:
    """The folder of SpikeInterface in which a file lies."""
    top = next(one for one in path.parents if (one / "si_folder.json").exists() or one.suffix == ".zarr")
    return lazily("neural.io.formats.sorted_folder", "read_sorted_folder")(top)


SAMPLE, UNIT, NAMES = np.array([30, 60, 90, 120]), np.array([0, 1, 0, 1]), ["a", "b"]
for one in ("spikes.npy", "numpysorting_info.json", "si_folder.json"):

    @reader(f"sorting, {one}", sorted_folder, text=one[-1] == "n")
    def sorting(folder: Path, one: str = one) -> Path:
        about = {"sampling_frequency": 30000.0, "unit_ids": NAMES, "num_segments": 1}
        (folder / "numpysorting_info.json").write_text(json.dumps(about))
        fields = [("sample_index", "int64"), ("unit_index", "int64"), ("segment_index", "int64")]
        np.save(folder / "spikes.npy", np.array(list(zip(SAMPLE, UNIT, [0] * 4, strict=True)), fields))
        (folder / "properties").mkdir(exist_ok=True)
        (folder / "si_folder.json").write_text(json.dumps({"class": "NumpyFolderSorting"}))
        return folder / one


@reader("sorting, npz", sorted_folder)
def npz(folder: Path) -> Path:
    names = {"unit_ids": NAMES, "num_segment": [1], "sampling_frequency": [30000.0]}
    np.savez(folder / "sorting_cached.npz", **names, spike_indexes_seg0=SAMPLE, spike_labels_seg0=np.array(NAMES)[UNIT])
    (folder / "si_folder.json").write_text(json.dumps({"class": "NpzFolderSorting"}))
    (folder / "properties").mkdir(exist_ok=True)
    return folder / "sorting_cached.npz"


for one in (
    ".zmetadata",
    "spikes/sample_index/0",
    "spikes/unit_index/0",
    "spikes/sample_index/.zarray",
):

    @reader(f"sorting in Zarr, {one}", sorted_folder, cases=40, text="/." in f"/{one}")
    def zarr_sorting(folder: Path, one: str = one) -> Path:
        import zarr

        top = folder / "a.zarr"
        group = zarr.open_group(top, mode="w", zarr_format=2)
        group.attrs.update(sampling_frequency=30000.0, num_segments=1)
        values = {
            "unit_ids": NAMES,
            "spikes/sample_index": SAMPLE,
            "spikes/unit_index": UNIT,
            "spikes/segment_slices": [[0, 4]],
        }
        for name, value in values.items():
            array = np.array(value)
            group.create_array(name, shape=array.shape, dtype=array.dtype, chunks=array.shape)[...] = array
        zarr.consolidate_metadata(top)
        return top / one


@reader("counts", lazily("neural.io.formats.binned", "read_binned", 0.01))
def counts(folder: Path) -> Path:
    np.save(folder / "a.npy", np.random.default_rng(0).poisson(1.0, (40, 5, 2)))
    return folder / "a.npy"


@reader("counts of MATLAB", lazily("neural.io.formats.binned", "read_binned", 0.01), cases=4)  # a process for each
def counts_of_matlab(folder: Path) -> Path:
    from scipy.io import savemat

    savemat(folder / "a.mat", {"counts": np.random.default_rng(0).poisson(1.0, (40, 5, 2)).astype(float)})
    return folder / "a.mat"


# Raw samples, with SpikeInterface in its own environment

IN_FOLDERS = {  # of the files that describe them: how a folder is made, and a part of the name
    "SpikeGLX": ("spikeglx", "*.ap.meta"),
    "Open Ephys": ("open_ephys", "structure.oebin"),
    "Open Ephys numbers": ("open_ephys", "sample_numbers.npy"),
}
for one in IN_FOLDERS if find_spec("spikeinterface") else ():

    @reader(f"recording, {one}", lambda path: _recording(path), cases=40, text=one != "Open Ephys numbers")
    def recording(folder: Path, one: str = one) -> Path:
        import recording_folders

        make, name = IN_FOLDERS[one]
        (folder / "recording").mkdir()
        return next(getattr(recording_folders, make)(folder / "recording").rglob(name))


def _recording(path: Path) -> Any:
    from vibrissa.neural.io.formats.traces import RawFormat, open_traces

    top = next(one for one in path.parents if one.name == "recording")
    return open_traces(top, RawFormat(pitch=None if path.suffix == ".meta" else 25e-6))


# Movies


def frames() -> np.ndarray:
    """A few small images."""
    return np.random.default_rng(1).integers(0, 256, (6, 16, 24)).astype(np.uint8)


def watched(path: Path) -> None:
    """All of a movie: what it says, its time stamps, its frames; with missing ones too."""
    from vibrissa.errors import InputError
    from vibrissa.video.io import movie

    movie.open_movie(path)
    movie.frame_times_of(path)
    movie.key_frames_of(path)
    for how in (None, "nan"):
        try:
            for _ in movie.read_blocks(path, 2, drop_frames=how):
                pass
        except InputError:
            if how is None:
                raise


for suffix, codec in ((".mkv", "ffv1"), (".avi", "ffvhuff"), (".mp4", "h264"), (".tif", "")):

    @reader(f"movie {suffix}", watched, cases=40)
    def film(folder: Path, suffix: str = suffix, codec: str = codec) -> Path:
        from vibrissa.video.io.movie import write_movie

        write_movie(folder / f"a{suffix}", [frames()], codec or "ffv1")
        return folder / f"a{suffix}"


@reader("movie .npy", watched)
def array_of_frames(folder: Path) -> Path:
    np.save(folder / "a.npy", frames())
    return folder / "a.npy"


for one in (".cih", ".cihx", ".mraw"):

    @reader(f"movie {one}", watched, cases=60, text=one != ".mraw")
    def photron(folder: Path, one: str = one) -> Path:
        count, height, width = frames().shape
        said = {"Total Frame": count, "Image Width": width, "Image Height": height, "Color Bit": 8}
        said |= {"EffectiveBit Depth": 8, "Record Rate(fps)": 500}
        (folder / "a.mraw").write_bytes(frames().tobytes())
        if one == ".cihx":
            info = "<recordInfo><recordRate>500</recordRate></recordInfo>"
            info += f"<frameInfo><totalFrame>{count}</totalFrame></frameInfo>"
            image = f"<resolution><width>{width}</width><height>{height}</height></resolution>"
            depth = "<effectiveBit><depth>8</depth><side>Lower</side></effectiveBit><colorInfo><bit>8</bit></colorInfo>"
            (folder / "a.cihx").write_text(f"<cih>{info}<imageDataInfo>{image}{depth}</imageDataInfo></cih>")
        else:
            (folder / "a.cih").write_text("\n".join(f"{key} : {value}" for key, value in said.items()))
        return folder / f"a{one}"


for suffix in (".png", ".jpg", ".tif"):

    @reader(f"image {suffix} of a folder", lambda path: watched(path.parent))
    def image(folder: Path, suffix: str = suffix) -> Path:
        import av
        import tifffile

        codec, pixels = ("mjpeg", "yuvj420p") if suffix == ".jpg" else ("png", "gray")
        for number, one in enumerate(frames()):
            path = folder / f"{number:03d}{suffix}"
            if suffix == ".tif":
                tifffile.imwrite(path, one, compression="zlib")
                continue
            with av.open(str(path), "w", format="image2") as file:
                stream = file.add_stream(codec, rate=25)
                stream.height, stream.width, stream.pix_fmt = *one.shape, pixels
                file.mux(stream.encode(av.VideoFrame.from_ndarray(one, format="gray")))
                file.mux(stream.encode())
        return folder / f"003{suffix}"


# Tracks of other programs


@reader("whiskers", lambda path: _tracks(path, identity="number", base="left"), cases=80)
def whiskers(folder: Path) -> Path:
    from test_malformed_tracks import segment
    from test_malformed_tracks import whiskers as content

    (folder / "a.whiskers").write_bytes(
        content(*(segment(frame=f, wid=w, points=12) for f in range(3) for w in range(2)))
    )
    return folder / "a.whiskers"


@reader("lines of .whiskers", lazily("video.foreign.whisk_files", "read_whiskers"), cases=40)
def lines(folder: Path) -> Path:
    return whiskers(folder)


@reader("measurements", lambda path: _tracks(path.with_suffix(".whiskers")), cases=40)
def measurements(folder: Path) -> Path:
    from test_malformed_tracks import measurements as content
    from test_malformed_tracks import segment
    from test_malformed_tracks import whiskers as lines_of

    (folder / "a.whiskers").write_bytes(lines_of(segment()))
    (folder / "a.measurements").write_bytes(content())
    return folder / "a.measurements"


@reader("splines of MATLAB", lambda path: _tracks(path), cases=4)
def splines(folder: Path) -> Path:
    from scipy.io import savemat

    savemat(folder / "a.mat", {"g_tMovieInfo": {"SplinePoints": 1 + 100 * np.random.default_rng(0).random((3, 2, 6))}})
    return folder / "a.mat"


@reader("keypoints of SLEAP", lambda path: _tracks(path), cases=4)
def sleap(folder: Path) -> Path:
    import h5py

    with h5py.File(folder / "a.h5", "w") as file:
        file["tracks"] = 5 + np.random.default_rng(0).random((1, 2, 3, 12))
        file["node_names"] = [b"base", b"middle", b"tip"]
        file["track_names"] = [b"C1"]
        file["point_scores"] = np.ones((1, 3, 12))
    return folder / "a.h5"
