"""Sizes of a study from which the costs of its stages follow."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from vibrissa.errors import InputError
from vibrissa.study.spec.parts import every_by_modes, has_rod, table_of
from vibrissa.study.spec.settings import Study
from vibrissa.study.stages.prices import FIT_FRAME, ROD_SECOND, SWEEP_FRAME, TRACKS, tracking_time
from vibrissa.study.sweeps.laboratory import plan as planned_sweeps
from vibrissa.video.io.movie import DropFrames, frames_within, open_movie, with_missing_frames


@dataclass(frozen=True)
class Sizes:
    """Sizes of a study from which the costs follow.

    Attributes
    ----------
    study : Study
        What is asked.
    kept : int
        Sweeps that are stored already.
    """

    study: Study
    kept: int = 0

    @cached_property
    def sweeps(self) -> tuple[list[int], float]:
        """Frames of each sweep, those of the paper's model last, and processor time of all [s]."""
        laboratory = self.study.laboratory
        if laboratory is not None:
            each = [laboratory.frames(one.scan.speed) for one in planned_sweeps(laboratory)[0]]
            by_modes = each[::every] if (every := every_by_modes(self.study)) else []
            return each + by_modes, SWEEP_FRAME * sum(each + by_modes) + self.rod_time(sum(each))
        table = table_of(self.study)
        sizes = [(TRACKS, 0) if one.movie is None else _size_of(one.folder / one.movie) for one in table]
        return [frames for frames, _ in sizes], sum(tracking_time(*size) + FIT_FRAME * size[0] for size in sizes)

    @property
    def left(self) -> int:
        """Sweeps that are still to be analysed."""
        return max(0, len(self.sweeps[0]) - self.kept)

    @property
    def of_rod(self) -> int:
        """Virtual sweeps whose truth is the rod."""
        laboratory = self.study.laboratory
        return laboratory.n_sweeps if laboratory is not None and has_rod(self.study) else 0

    def rod_time(self, frames: int) -> float:
        """Processor time of the rod that makes frames [s]; 0 where the truth is another.

        Parameters
        ----------
        frames : int
            Number of frames.

        Returns
        -------
        float
            [s].
        """
        laboratory = self.study.laboratory
        return ROD_SECOND * frames / laboratory.camera.frame_rate if laboratory is not None and self.of_rod else 0.0

    @property
    def longest(self) -> int:
        """Frames of the longest sweep."""
        return max(self.sweeps[0], default=0)

    @property
    def unstored(self) -> float:
        """Size that the movies of a laboratory would have, a byte per pixel of its camera's field [bytes]."""
        if self.study.laboratory is None:
            return 0.0
        camera = self.study.laboratory.camera
        return float(sum(self.sweeps[0])) * camera.width * camera.height

    @cached_property
    def movie(self) -> tuple[int, int]:
        """Frames of the movie, virtual or recorded, that are tracked, and pixels of one; none if it cannot be read."""
        if self.study.film is not None:
            return self.study.film.n_frames, self.study.film.camera.width * self.study.film.camera.height
        movie = self.study.movie
        if movie is None:
            return 0, 0
        return _size_of(self.study.folder / movie.path, movie.start, movie.stop, movie.drop_frames)


def _size_of(movie: Path, start: int = 0, stop: int | None = None, drop_frames: DropFrames = None) -> tuple[int, int]:
    """Frames of a part of a movie and pixels of one; none where it cannot be read, which the plan or the run reports.

    A number of frames that the movie only estimates may be less than ``start``.
    """
    try:
        about = with_missing_frames(open_movie(movie), drop_frames)
        return max(0, frames_within(about, start, stop)), about.width * about.height
    except InputError:
        return 0, 0
