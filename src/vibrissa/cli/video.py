"""The verbs of movies: `track` and `decompose`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Literal

from vibrissa.cli.options import Atlas, Json, OfWhisker, Out, needed_cone
from vibrissa.cli.output import progress_bars, show
from vibrissa.errors import InputError


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
    cone = needed_cone(whisker, atlas)
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


def _pixel(text: str, option: str) -> tuple[float, float]:
    try:
        column, row = map(float, text.split(","))
    except ValueError:
        raise InputError(option, "must be COLUMN,ROW", repr(text), f"for example {option} 120,187") from None
    return column, row


def _with_ends(name: str) -> tuple[str, str, str]:
    return name, f"{name}_low", f"{name}_high"
