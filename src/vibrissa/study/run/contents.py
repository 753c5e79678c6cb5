"""What any file is, in facts and as data to draw: a dataset, a table, a surface, a movie, a study, a folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vibrissa.errors import FormatError, InputError, MissingError
from vibrissa.files import existing
from vibrissa.tables.text import each_line, first_line, header_names
from vibrissa.tables.units import channel_and_unit
from vibrissa.video.io.about import MOVIES

if TYPE_CHECKING:
    import xarray as xr

Facts = dict[str, Any]
DATASETS = (  # by variables that all of a kind have, the more special first
    ("map of the gain", {"cell_reason"}),
    ("command of a stimulator", {"command"}),
    ("predicted scan of a whole whisker, with spikes", {"contact_state", "spike_time"}),
    ("predicted scan of a whole whisker", {"contact_state", "envelope"}),
    ("predicted scan with spikes", {"mode_amplitude", "spike_time"}),
    ("units against their envelope", {"unit_name", "p_value"}),
    ("spikes", {"spike_time"}),
    ("sweeps of many recordings", {"accepted", "rejected"}),
    ("profiles of a tracked whisker", {"x", "y", "arc_length"}),
    ("predicted scan", {"mode_amplitude", "envelope"}),
    ("modal amplitudes", {"mode_displacement", "kappa"}),
    ("modes of a whisker", {"mode_shape"}),
    ("resonances", {"resonant_frequency", "damping"}),
    ("a gap crossed", {"excursion_at_jump"}),
    ("stationary profile", {"profile_x", "profile_y"}),
)
TABLES = (  # by columns, without the suffix of their unit
    ("gaps of a texture", {"position", "width"}),
    ("spikes", {"unit", "spike_time"}),
    ("kinematics of whiskers", {"whisker", "label", "frame"}),
    ("touches of whiskers", {"whisker", "label", "touch_onset_seen"}),
    ("diameters along a whisker", {"distance", "diameter"}),
    ("posture in time", {"time", "base_angle"}),
    ("motion of a point", {"time", "displacement"}),
    ("trials", {"start", "stop"}),
    ("units to simulate", {"unit", "threshold"}),
    ("textures of trials", {"trial", "texture"}),
    ("recorded sweeps", {"whisker", "texture"}),
    ("height profile", {"position", "height"}),
    ("signals in time", {"time"}),
)
FOREIGN = {".whiskers", ".measurements", ".slp", ".h5", ".hdf5", ".mat"}


class Contents(NamedTuple):
    """What a file is: its kind, facts by name, and what can be drawn of it, if anything."""

    kind: str
    facts: Facts
    data: xr.Dataset | None = None


def contents(path: str | Path) -> Contents:
    """What a file, or a folder, is.

    Parameters
    ----------
    path : path
        Anything that a verb reads or writes.

    Returns
    -------
    Contents
        Kind, facts and data.

    Raises
    ------
    InputError
        If there is no such file, or it is none that is known here.
    """
    path = Path(path)
    if not path.exists():
        raise MissingError(str(path), "must be an existing file or folder")
    if path.is_dir():
        return _of_folder(path)
    existing(path)  # no pipe or device
    readers: dict[str, Callable[[Path], Contents]] = {
        ".nc": _of_dataset,
        ".csv": _of_table,
        ".toml": _of_study,
        ".nwb": _of_nwb,
        ".wav": _of_command,
        **dict.fromkeys(MOVIES, _of_movie),
        **dict.fromkeys(FOREIGN, _of_foreign),
    }
    return readers.get(path.suffix.lower(), _of_surface)(path)


def kind_of(data: xr.Dataset) -> str:
    """Kind of a dataset, by its variables.

    Parameters
    ----------
    data : Dataset
        Any of ours.

    Returns
    -------
    str
        ``dataset`` where it is none of those that are known.
    """
    names = {str(name) for name in data.variables}
    return next((kind for kind, needed in DATASETS if needed <= names), "dataset")


def _of_dataset(path: Path) -> Contents:
    from vibrissa.netcdf import load

    data = load(path)
    sizes = {str(name): int(size) for name, size in data.sizes.items()}
    return Contents(kind_of(data), {**sizes, **{str(name): value for name, value in data.attrs.items()}}, data)


def _of_table(path: Path) -> Contents:
    names = header_names(first_line(path), "")
    bare = {channel_and_unit(name)[0] for name in names}
    kind = next((kind for kind, needed in TABLES if needed <= bare), "")
    if kind == "gaps of a texture" or not kind or kind == "height profile":
        return _of_surface(path)
    facts: Facts = {"columns": ", ".join(names)}
    if kind != "spikes":
        return Contents(f"table: {kind}", facts | {"lines": sum(1 for _ in each_line(path)) - 1})
    from vibrissa.neural.io.tables.spike_csv import read_spikes

    data = read_spikes(path, all_trials=True)
    return Contents("table: spikes", facts | {"units": data.sizes["unit"], "spikes": data.sizes["spike"]}, data)


def _of_surface(path: Path) -> Contents:
    from vibrissa.texture.relief import HeightProfile
    from vibrissa.texture.surface import Gaps

    notes: list[str] = []
    try:
        found = _surface(path, notes)
    except InputError as error:
        if path.suffix == ".npy" and "must state its units" not in error.rule:  # that of two columns, a surface
            return _of_movie(path)
        known = "a dataset, a table, a surface, a movie, a study or a folder of results"
        got, cure = (
            f", got {error.value}" if error.value else "",
            f"; to scan it: {error.remedy}" if error.remedy else "",
        )
        raise FormatError(str(path), f"must be {known}", remedy=f"as a surface it {error.rule}{got}{cure}") from error
    said = dict.fromkeys(notes, "")
    if isinstance(found, Gaps):
        facts = {"gaps": len(found.width), "widest gap [m]": float(found.width.max()), "depth [m]": found.depth}
        shown = HeightProfile.from_gaps(found)
    else:
        facts, shown = {"points": len(found.position), "height, peak to valley [m]": float(np.ptp(found.height))}, found
    facts["length [m]"] = float(np.ptp(shown.position))
    kind = "gaps" if isinstance(found, Gaps) else "heights"
    return Contents(f"surface: {kind}", facts | said, _profile(shown))


def _surface(path: Path, notes: list[str]) -> Any:
    """Gaps or heights; a tilted profile without the line fitted to it."""
    from vibrissa.texture.io import read_texture

    try:
        return read_texture(path, tell=notes.append)
    except InputError as tilted:
        try:
            level = read_texture(path, level="line", tell=notes.append)
        except InputError:
            raise tilted from None
        notes.append("it is tilted: shown without the line fitted to it; a scan asks whether to subtract it")
        return level


def _profile(relief: Any) -> xr.Dataset:
    import xarray as xr

    height = xr.Variable("position", relief.height, {"units": "m", "long_name": "height"})
    return xr.Dataset({"height": height}, {"position": ("position", relief.position, {"units": "m"})})


def _of_study(path: Path) -> Contents:
    from vibrissa.study.run.plan_summary import parts_lines
    from vibrissa.study.spec.settings import read_study

    return Contents("study", dict.fromkeys(parts_lines(read_study(path)), ""))


def _of_movie(path: Path) -> Contents:
    import xarray as xr

    from vibrissa.video.io.movie import open_movie, read_blocks

    movie = open_movie(path)
    facts: Facts = {
        "width [px]": movie.width,
        "height [px]": movie.height,
        "frames": f"{'about ' if movie.frame_count_is_estimate else ''}{movie.frame_count}",
        "bits": movie.bits,
        "codec": f"{movie.codec}{', lossy' if movie.lossy else ''}",
        "checksums": "of every frame" if movie.checksums else "none: damaged bytes may pass unseen",
    }
    rates = {"frame rate [Hz]": movie.frame_rate, "playback rate, not the camera's [Hz]": movie.playback_rate}
    facts |= {name: rate for name, rate in rates.items() if rate == rate}
    frame = next(iter(read_blocks(path, 1)))[0]
    return Contents("movie", facts, xr.Dataset({"grey": (("row", "column"), frame)}))


def _of_command(path: Path) -> Contents:
    from vibrissa.stimulus.export import read_command

    data = read_command(path)
    facts = {str(name): int(size) for name, size in data.sizes.items()}
    return Contents("command of a stimulator", facts, data)


def _of_nwb(path: Path) -> Contents:
    import h5py

    from vibrissa.neural.io.formats.foreign import one_line

    with one_line(str(path), "must be a whole NWB file"), h5py.File(path, "r") as file:
        facts: Facts = {"session": _text(file, "session_description"), "start": _text(file, "session_start_time")}
        for name in ("acquisition", "stimulus/presentation", "stimulus/templates", "processing", "intervals"):
            if some := ", ".join(_with_series(key, one) for key, one in file.get(name, {}).items()):
                facts[name] = some
        if "units" in file:
            facts["units"] = len(file["units/id"])
    return Contents("NWB session", facts)


def _with_series(name: str, group: Any) -> str:
    """Name of a part of an NWB file, and of the series in it, as a stimulus is chosen by these."""
    inner = [key for key, one in group.items() if "data" in getattr(one, "keys", tuple)()]
    return f"{name} ({', '.join(inner)})" if inner else name


def _text(file: Any, name: str) -> str:
    value = file[name][()] if name in file else b""
    return value.decode() if isinstance(value, bytes) else str(value)


def _of_foreign(path: Path) -> Contents:
    return Contents("tracks of another program", {"read by": f"vibrissa import-tracks {path.name}"})


def _of_folder(path: Path) -> Contents:
    if path.suffix == ".zarr":
        import xarray as xr

        data = xr.open_zarr(path)
        return Contents(kind_of(data), {str(name): int(size) for name, size in data.sizes.items()})
    files = sorted(path.glob("*.nc"))
    if not files:
        return _of_movie(path)
    import xarray as xr

    from vibrissa.netcdf import reading

    facts: Facts = {}
    for file in files:
        with reading(file), xr.open_dataset(file, engine="h5netcdf", decode_times=False) as data:
            sizes = ", ".join(f"{name} {size}" for name, size in data.sizes.items())
            facts[file.name] = kind_of(data) if kind_of(data) != "dataset" else f"dataset: {sizes or 'single numbers'}"
    report = path / "report.html"
    return Contents("folder of results", facts | ({"report": str(report)} if report.exists() else {}))
