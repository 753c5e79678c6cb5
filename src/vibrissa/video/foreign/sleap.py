"""Labels of SLEAP of which a reader would leave out a part."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import ConflictError, MissingError

ASSIGN = "assign tracks in SLEAP and delete instances that are of none"


def refuse_unassigned(path: str | Path) -> None:
    """Refuse labels in which it is not known which animal, or which video, an instance is of.

    Without tracks a frame may hold one predicted instance and one labelled by hand, which is then taken.

    Parameters
    ----------
    path : path
        A file of SLEAP. Analysis files have a row for every track, and pass.

    Raises
    ------
    InputError
        If frames are of several videos, or of one that is not the first; if a frame has several instances of no track,
        or of one; or if some instances have a track and others not.
    """
    import h5py

    with h5py.File(path, "r") as file:
        if "instances" not in file:
            return
        frames, instances = file["frames"][:], file["instances"][:]
        videos, tracks = ([json.loads(one) for one in file[name][:]] for name in ("videos_json", "tracks_json"))
    if len(videos) > 1 and frames["video"].any():
        remedy = "save each video with its labels as a file of its own in SLEAP, or export analysis files"
        raise ConflictError(str(path), "must be of one video", ", ".join(map(_name, videos)), remedy)
    start, end = (frames[f"instance_id_{name}"].astype(int) for name in ("start", "end"))
    rows = np.concatenate([np.zeros(0, int), *map(np.arange, start, end)])
    frame = np.repeat(frames["frame_idx"].astype(int), end - start)
    _refuse_doubles(str(path), frame, instances[rows], [str(one[1]) for one in tracks])


def _refuse_doubles(path: str, frame: NDArray[Any], instances: NDArray[Any], tracks: list[str]) -> None:
    without = instances["track"] < 0
    if tracks and without.any():
        place = f"{path}, frame {frame[np.argmax(without)]}"
        raise MissingError(place, "must have a track for every instance", remedy=ASSIGN)
    keys = np.stack([frame, instances["track"], instances["instance_type"]])
    (frames, track, _), count = np.unique(keys, axis=1, return_counts=True)
    if (count > 1).any():
        at = int(np.argmax(count > 1))
        which = f"of track {tracks[track[at]]}" if track[at] >= 0 else "of no track"
        rule = "must have one instance of an animal"
        raise MissingError(f"{path}, frame {frames[at]}", rule, f"{count[at]} {which}", ASSIGN)


def _name(video: dict[str, Any]) -> str:
    """Name of a movie's file, or of the first of a sequence of images."""
    name = video.get("filename") or video.get("backend", {}).get("filename", "?")
    return Path(str(name[0] if isinstance(name, list) else name)).name
