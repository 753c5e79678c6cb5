"""The command line: one command per verb. Heavy imports stand inside the commands."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, CycloptsError, Parameter

from vibrissa import __version__
from vibrissa.cli.neural import neural
from vibrissa.cli.output import progress_bars, show
from vibrissa.cli.replay import replay
from vibrissa.errors import ConvergenceError, InputError
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    from vibrissa.mechanics.profile import Posture

app = App(name="vibrissa", help="From surface to spikes: how a rat's whisker feels fine texture.", version=__version__)

Json = Annotated[
    bool,
    Parameter(
        name="--json",
        negative="",
        help="Print one JSON object instead of a table: SI units, or adimensional as the names of `vibrissa` say.",
    ),
]
Out = Annotated[Path | None, Parameter(help="Write the results as a dataset (NetCDF).")]
OfWhisker = Annotated[Whisker | None, Parameter(help="The whisker's geometry and material (SI units).")]
Atlas = Annotated[str | None, Parameter(help="Take a measured rat whisker instead: C2, beta, …")]


@app.command
def run(study: Path | None = None, *, out: Path = Path("vibrissa-out"), json: Json = False) -> None:
    """Run a study: the main job. Without one, the built-in virtual experiment.

    Parameters
    ----------
    study
        Study file (TOML).
    out
        Folder for datasets and report; made if absent.
    """
    from vibrissa.study.settings import read_study
    from vibrissa.study.study import run_study

    with progress_bars() as progress:
        verdict = run_study(read_study(study), out, progress=progress)
    print(f"vibrissa: the report is {out / 'report.html'}", file=sys.stderr)
    show(verdict, None, json, None)


@app.command
def track(
    movie: Path,
    *,
    frame_rate: float,
    pixel_size: float,
    seed: list[str],
    skin: list[str] | None = None,
    base: Literal["left", "right"] = "left",
    polarity: Literal["dark", "bright"] = "dark",
    out: Path | None = None,
    json: Json = False,
) -> None:
    """Track whiskers in a movie: centrelines at nodes of fixed arc length.

    Parameters
    ----------
    movie
        AVI, MP4, MKV or multi-page TIFF, grey.
    frame_rate
        Frames per second of the acquisition [Hz]; a file knows its playback rate only.
    pixel_size
        Side of a pixel in the plane of the whiskers [m].
    seed
        COLUMN,ROW of a point of a whisker in the first frame [pixels]; once for each whisker.
    skin
        COLUMN,ROW of the point where a whisker leaves the skin [pixels]; once for each whisker, or not at all: then arc
        length counts from where each is first seen.
    base
        Side of the image on which the whiskers leave the skin.
    polarity
        Whiskers darker or brighter than what is behind them.
    out
        Dataset to write (NetCDF); MOVIE's name with .nc in the current folder by default.
    """
    from vibrissa.files import save
    from vibrissa.study.backward import followed, track_file
    from vibrissa.study.settings import MovieFile

    seeds = tuple(_pixel(text, "--seed") for text in seed)
    settings = MovieFile(
        path=str(movie),
        frame_rate=frame_rate,
        pixel_size=pixel_size,
        seeds=seeds,
        skin=tuple(_pixel(text, "--skin") for text in skin) if skin else None,
        base=base,
        polarity=polarity,
    )
    with progress_bars() as progress:
        profile = track_file(settings, Path(), progress)
    out = out or Path(movie.name).with_suffix(".nc")
    save(profile, out)
    print(f"vibrissa: the profiles are in {out}", file=sys.stderr)
    show(followed(profile), None, json, None)


@app.command
def decompose(
    profile: Path,
    *,
    contact: float,
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    which: int = 0,
    count: int = 3,
    method: Literal["least-squares", "paper2014"] = "least-squares",
    out: Out = None,
    json: Json = False,
) -> None:
    """Modal amplitudes, envelopes, resonances and damping of one tracked whisker.

    Resonances are fitted with the forcing taken for white (Eq. 5); a study that knows its texture does better.

    Parameters
    ----------
    profile
        Dataset written by `vibrissa track`; arc length counts from the skin.
    contact
        Position of the contact over the length of the nontruncated cone: 0 at the cone's tip, 1 at the base.
    which
        Which of the tracked whiskers, from 0.
    count
        Number of modes.
    method
        Least squares on the visible nodes, or the paper's projection of an extrapolated profile.
    """
    import xarray as xr

    from vibrissa.files import load
    from vibrissa.quantities import require
    from vibrissa.study.backward import analyse

    tracks = load(profile)
    require(tracks, "x", "y", "arc_length", "whisker")
    if not 0 <= which < tracks.sizes.get("whisker", 0):
        raise InputError("--which", f"must name one of the {tracks.sizes.get('whisker', 0)} tracked whiskers", which)
    cone = _needed(whisker, atlas)
    results = analyse(tracks.isel(whisker=which), cone, contact, n_modes=count, method=method)
    data = xr.merge([*reversed(results.values())], combine_attrs="override").assign_attrs(results["modal"].attrs)
    for one in results.values():
        if "left_out" in one.attrs:
            print(f"vibrissa: left out: {one.attrs['left_out']}", file=sys.stderr)
    if "resonance_white" in results:
        print(
            "vibrissa: the forcing is taken for white (Eq. 5); a study that knows its texture does better",
            file=sys.stderr,
        )
    names = ("kappa", "variance_explained", *_with_ends("resonant_frequency"), *_with_ends("damping"))
    show(data, [name for name in names if name in data], json, out)


@app.command
def modes(
    *,
    contact: float | None = None,
    count: int = 3,
    boundary: Literal["pinned", "free"] = "pinned",
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Resonant modes of a whisker: pinned at a contact, or with a free tip.

    Parameters
    ----------
    contact
        Position of the contact (or of the free end) over the length of the nontruncated cone: 0 at the cone's tip,
        1 at the base.
        May be left out for a free tip: the whisker's own tip, or the whole cone.
    count
        Number of modes.
    boundary
        What holds at the contact.
    """
    from vibrissa.mechanics.modes import eigenmodes, resonances

    cone = _cone(whisker, atlas)
    if contact is None:
        if boundary == "pinned":
            raise InputError("--contact", "must be given for a pinned whisker", remedy="for example --contact 0.3")
        contact = cone.tip if cone else 0.0
    data = (
        resonances(cone, contact, count, boundary=boundary) if cone else eigenmodes(contact, count, boundary=boundary)
    )
    show(data, ["contact", "kappa", *(["resonant_frequency"] if cone else [])], json, out)


@app.command
def profile(
    *,
    contact: float | None = None,
    base_distance: float | None = None,
    base_angle: float,
    friction: float = 0.4,
    contact_distance: float | None = None,
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Stationary profile of a whisker held at its base, its contact on the flat or on an edge (Eq. 1).

    Lengths are over the length L of the nontruncated cone. With a whisker, forces also in newtons.

    Parameters
    ----------
    contact
        Position of the contact along the shaft, over L: 0 at the cone's tip, 1 at the base. This or --base-distance.
    base_distance
        Instead: height of the base above the substrate, over L.
    base_angle
        Angle of the shaft at the base to the substrate [rad], below π/2.
    friction
        Coefficient of friction of the substrate, which moves away from the base.
    contact_distance
        Distance of an edge from the base along the substrate, over L: the whisker is held there, its base kept.
    """
    from vibrissa.mechanics.crossing import held_profile

    cone = _cone(whisker, atlas)
    data = held_profile(
        _posture(contact, base_distance, base_angle, friction), contact_distance=contact_distance, whisker=cone
    )
    if not float(data.fold_determinant) < 0:
        print("vibrissa: beyond the fold: no quasi-static response to an edge exists here", file=sys.stderr)
    show(data, [str(name) for name in data.data_vars if not data[name].dims], json, out)


@app.command
def gap(
    *,
    contact: float | None = None,
    base_distance: float | None = None,
    base_angle: float,
    gap_width: float,
    friction: float = 0.4,
    count: int = 3,
    out: Out = None,
    json: Json = False,
) -> None:
    """A gap crossed: when the contact jumps, and how far the linear response is from the exact one (Eq. 11).

    Lengths are over the length L of the nontruncated cone.

    Parameters
    ----------
    contact
        Position of the contact along the shaft, over L: 0 at the cone's tip, 1 at the base. This or --base-distance.
    base_distance
        Instead: height of the base above the substrate, over L.
    base_angle
        Angle of the shaft at the base to the substrate [rad], below π/2.
    friction
        Coefficient of friction of the substrate, which moves away from the base.
    gap_width
        Width of the gap, over L: 0.015 is 0.6 mm for a cone of 40 mm.
    count
        Number of modes.
    """
    from vibrissa.mechanics.crossing import crossing

    data = crossing(_posture(contact, base_distance, base_angle, friction), gap_width, n_modes=count)
    show(data, [str(name) for name in data.data_vars if "s" not in data[name].dims], json, out)


@app.command
def scan(
    texture: Path,
    *,
    contact: float | None = None,
    base_distance: float | None = None,
    base_angle: float,
    friction: float = 0.4,
    scan_speed: float,
    damping: float = 0.11,
    sampling_rate: float = 20000.0,
    response: Literal["exact", "linear"] = "exact",
    jump: Literal["continuous", "ramp-limit", "paper2014"] = "continuous",
    reverse: Annotated[bool, Parameter(negative="")] = False,
    count: int = 3,
    node: list[float] | None = None,
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """A texture drawn past a whisker: its vibration, what the follicle feels, and how far the assumptions hold.

    Time 0 is the moment x = 0 meets the contact; the record ends when the ringing after the last gap has died away.

    Parameters
    ----------
    texture
        CSV with columns position,width in metres, or position_um,width_um or _mm (and depth, if it is not 35 µm): the
        edge of each gap that meets the contact first, in order of arrival.
    contact
        Position of the contact along the shaft, over L: 0 at the cone's tip, 1 at the base. This or --base-distance.
    base_distance
        Instead: height of the base above the substrate, over L.
    base_angle
        Angle of the shaft at the base to the substrate [rad], below π/2.
    friction
        Coefficient of friction of the substrate, which moves away from the base.
    scan_speed
        Speed of the texture [m/s].
    damping
        Damping ratio of every mode.
    sampling_rate
        Samples per second [Hz].
    response
        Quasi-static response of the profile held by the edge, or the paper's linear one.
    jump
        What the velocity does where the contact jumps.
    reverse
        Scan the texture in the other direction: its last edge meets the contact first, as long after time 0 as its
        first one did.
    count
        Number of modes. In the exact response the first millisecond of force and moment after a jump grows with it.
    node
        Distance from the base of a point of the shaft whose motion is wanted [m]; once for each.
    """
    from vibrissa.mechanics.diagnostics import remarks
    from vibrissa.mechanics.sampled import scanned
    from vibrissa.mechanics.superposition import Scan, predict
    from vibrissa.texture.io import read_troughs

    cone, troughs = _needed(whisker, atlas), read_troughs(texture)
    if reverse:
        troughs = troughs.reversed(float(troughs.position[0] + troughs.end[-1]))
    how = Scan(speed=scan_speed, damping=damping, jump=jump, response=response)
    prediction = predict(cone, _posture(contact, base_distance, base_angle, friction), troughs, how, n_modes=count)
    data = scanned(prediction, sampling_rate, nodes=node)
    for line in remarks(data):
        print(f"vibrissa: {line}", file=sys.stderr)
    show(data, [str(name) for name in data.data_vars if not {"time", "trough"} & set(data[name].dims)], json, out)


@app.command(name="whisker")
def whisker_command(
    diameters: Path, *, physical_length: float | None = None, out: Out = None, json: Json = False
) -> None:
    """Geometry of a whisker from measured diameters: length of the cone and cone angle, with standard errors.

    Parameters
    ----------
    diameters
        CSV with columns distance,diameter in metres (or distance_mm, diameter_um), from the base.
    physical_length
        Length of the whisker itself [m], if measured; the last measured distance by default.
    """
    from vibrissa.study.geometry import fit_dataset

    show(fit_dataset(diameters, physical_length), None, json, out)


@app.command(name="atlas")
def atlas_command(
    name: str | None = None,
    *,
    resonances: Annotated[bool, Parameter(negative="")] = False,
    out: Out = None,
    json: Json = False,
) -> None:
    """Measured rat whiskers by row and column, with the first resonance of each in air.

    Parameters
    ----------
    name
        One of them only: C2, beta, …
    resonances
        Instead, the single whiskers whose resonances were measured, beside what their own geometry predicts.
    """
    from vibrissa.study.geometry import atlas_dataset, measured_resonances

    show(measured_resonances() if resonances else atlas_dataset(name), None, json, out)


app.command(replay)
app.command(neural)


def main() -> None:
    """Run the command line; bad input is one line on stderr and exit code 2."""
    try:
        app(sys.argv[1:], print_error=False, exit_on_error=False)
    except CycloptsError as error:
        line = " ".join(str(error).split()).replace("requires an argument", "must be given, with its value")
        _refuse(f"{line.rstrip('.')}; see --help")
    except (InputError, ConvergenceError) as error:
        _refuse(str(error))
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:  # who reads our output has heard enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)


def _refuse(line: str) -> None:
    print(f"vibrissa: {line}", file=sys.stderr)
    sys.exit(2)


def _pixel(text: str, option: str) -> tuple[float, float]:
    try:
        column, row = map(float, text.split(","))
    except ValueError:
        raise InputError(option, "must be COLUMN,ROW", repr(text), f"for example {option} 120,187") from None
    return column, row


def _cone(whisker: Whisker | None, atlas: str | None) -> Whisker | None:
    if whisker is not None and atlas is not None:
        raise InputError("whisker", "must be given once", remedy="either --whisker.length and the rest, or --atlas")
    if atlas is None:
        return whisker
    from vibrissa.whisker import atlas_whisker

    return atlas_whisker(atlas)


def _needed(whisker: Whisker | None, atlas: str | None) -> Whisker:
    cone = _cone(whisker, atlas)
    if cone is None:
        raise InputError("whisker", "must be given", remedy="--whisker.length and --whisker.cone-angle, or --atlas")
    return cone


def _posture(contact: float | None, base_distance: float | None, base_angle: float, friction: float) -> Posture:
    from vibrissa.mechanics.profile import Posture

    if contact is None and base_distance is not None:
        return Posture.at_height(base_distance, base_angle, friction)
    if contact is None or base_distance is not None:
        raise InputError("posture", "must be given once", remedy="either --contact or --base-distance")
    return Posture(contact=contact, base_angle=base_angle, friction=friction)


def _with_ends(name: str) -> tuple[str, str, str]:
    return name, f"{name}_low", f"{name}_high"
