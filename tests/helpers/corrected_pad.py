"""A small movie of a simulated pad with its lines, linked, as the page to correct it opens it."""

import threading
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from simulated_segments import HEIGHT, WIDTH, Pad, simulate

from vibrissa.netcdf import save
from vibrissa.page.correct.correcting import tracked, write_corrected
from vibrissa.page.correct.server import CorrectionServer
from vibrissa.page.correct.session import CorrectionSession
from vibrissa.video.correct.edit_file import edit_path
from vibrissa.video.correct.opening import open_tracks
from vibrissa.video.io.frame_store import FrameStore
from vibrissa.video.io.movie import write_movie
from vibrissa.video.link.courses.cut_lines import cut_lines, cut_segments
from vibrissa.video.link.whisker_linking import link_again, link_segments
from vibrissa.video.linked.linked_profile import profile_from_linking
from vibrissa.video.tracking import Calibration


def drawn(segments):
    """Frames with dark lines where the segments are."""
    frames = np.full((segments.attrs["frames"], HEIGHT, WIDTH), 190, np.uint8)
    size = np.diff(np.append(segments.segment_start.values, segments.sizes["point"]))
    frame = np.repeat(segments.segment_frame.values, size)
    column, row = (segments[name].values.round().astype(int) for name in ("column", "row"))
    inside = (column >= 0) & (column < WIDTH - 1) & (row >= 0) & (row < HEIGHT - 1)
    for right, down in ((0, 0), (1, 0), (0, 1)):
        frames[frame[inside], row[inside] + down, column[inside] + right] = 90
    return frames


def make_pad(folder: Path, frames: int, whiskers: int = 6):
    """Movie, lines and profile of a pad, in a folder."""
    segments, truth = simulate([Pad(whiskers=whiskers, frames=frames, broken=0.05)], 3)
    first = link_segments(segments)
    cut = cut_lines(first)
    made = SimpleNamespace(
        movie=folder / "pad.mkv",
        profile=folder / "pad.nc",
        segments=folder / "lines.nc",
        owner=truth.segment[cut.source],
    )
    write_movie(made.movie, [drawn(segments)])
    lines = cut_segments(segments, cut)
    linking = link_again(lines, first)[-1]
    save(lines.assign(segment_whisker=linking.identity().segment_whisker), made.segments)
    calibration = Calibration(frame_rate=200.0, pixel_size=1e-4)
    save(profile_from_linking(linking, calibration, source="pad"), made.profile)
    return made


@contextmanager
def served_pad(pad, out: Path):
    """Serve the page of a pad as the verb does; gives its address, its session and what is opened."""
    edits, said = edit_path(pad.profile), []
    opened = open_tracks(
        pad.profile, pad.movie, segments=pad.segments, edits=edits, tell=said.append, progress=lambda *_: None
    )
    frames = FrameStore(pad.movie)
    session = CorrectionSession(
        opened.correction, frames, opened.movie, edits, lambda: write_corrected(opened, out), tracked(opened)
    )
    with CorrectionServer(session) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
        thread.start()
        yield SimpleNamespace(
            root=server.address, session=session, opened=opened, edits=edits, said=said, out=out, alive=thread.is_alive
        )
        server.shutdown()
        thread.join(5)
    frames.close()
