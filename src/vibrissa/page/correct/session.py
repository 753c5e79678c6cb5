"""A movie that is being corrected on the page: requests in, names and a line of text out."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from vibrissa.errors import FormatError, InputError, UnknownError
from vibrissa.page.answer.frames import packed
from vibrissa.page.correct.pictures import drawn_lines, drawn_names
from vibrissa.video.correct.correction import Correction
from vibrissa.video.correct.edit_file import EditedMovie, require_known, write_edits
from vibrissa.video.correct.edits import Edit, edit_of
from vibrissa.video.io.frame_store import FrameStore


class CorrectionSession:
    """One page's movie; requests are answered one after the other.

    Parameters
    ----------
    correction : Correction
        Edits of the movie.
    frames : FrameStore
        Its frames.
    movie : EditedMovie
        What the edits belong to.
    edits : Path
        File of the edits, written anew after each.
    save : callable
        Writes the corrected profile; gives a line that says so.
    tracked : dict
        Of :func:`vibrissa.page.correct.correcting.tracked`.
    """

    def __init__(
        self,
        correction: Correction,
        frames: FrameStore,
        movie: EditedMovie,
        edits: Path,
        save: Callable[[], str],
        tracked: Mapping[str, Any],
    ) -> None:
        self.correction, self.frames, self.movie, self.edits = correction, frames, movie, edits
        self.tracked = dict(tracked)
        self._save, self._lock = save, threading.Lock()
        self._in_file = self._in_profile = correction.edits
        self._does: dict[str, Callable[[Mapping[str, Any]], tuple[Edit, str]]] = {
            "edit": self._edit,
            "undo": lambda _: self._step(self.correction.undo, "Undone", 0),
            "redo": lambda _: self._step(self.correction.redo, "Redone", -1),
        }

    def start(self) -> bytes:
        """All lines and their names, with what the page must know of the movie."""
        with self._lock:
            named = self.correction.named
            arrays = drawn_lines(self.correction.linking) | drawn_names(named)
            facts = {**self.movie._asdict(), **self.tracked, **self._facts(), "edits_file": self.edits.name}
            return packed(facts, arrays)

    def answer(self, place: str, values: Mapping[str, Any]) -> bytes:
        """Do what is asked for.

        Parameters
        ----------
        place : {"edit", "undo", "redo"}
            What.
        values : mapping
            An edit; points are numbers of segments, of which the edit's own points are made.

        Returns
        -------
        bytes
            Names now, what was done in a line, and the whisker that was only called otherwise, if that was the edit;
            see :func:`vibrissa.page.answer.frames.packed`.

        Raises
        ------
        InputError
            If it cannot be done, its file not be written, or another program has written to that; names stay then.
        """
        with self._lock:
            if place not in self._does:
                raise UnknownError("request", f"must be one of {', '.join(self._does)}", place)
            require_known(self.edits, self.movie, self._in_file)
            edit, said = self._does[place](values)
            try:
                write_edits(self.edits, self.movie, self.correction.edits)
            except InputError:
                self._does["redo" if place == "undo" else "undo"]({})
                raise
            self._in_file = self.correction.edits
            done = {"did": place, "said": said, "called": edit.whisker if edit.do == "call" else None}
            return packed(self._facts() | done, drawn_names(self.correction.named))

    def save(self) -> str:
        """Write the corrected profile; gives a line that says so."""
        with self._lock:
            require_known(self.edits, self.movie, self._in_file)
            said = self._save()
            self._in_profile = self.correction.edits
            return said

    @property
    def unsaved(self) -> bool:
        """Whether edits are others than when the profile was saved last; before that, than at the beginning."""
        return self.correction.edits != self._in_profile

    def _facts(self) -> dict[str, Any]:
        correction = self.correction
        done, undone = len(correction.edits), correction.undone
        facts = {"names": correction.labels, "whiskers": correction.named.whiskers, "unsaved": self.unsaved}
        return facts | {"edits": done, "undone": undone}

    def _edit(self, values: Mapping[str, Any]) -> tuple[Edit, str]:
        edit = self._with_points(values)
        return edit, self.correction.apply(edit)

    def _step(self, step: Callable[[], Edit], word: str, beyond: int) -> tuple[Edit, str]:
        edit = step()
        return edit, f"{word}: {self.correction.said(len(self.correction.edits) + beyond)}"

    def _with_points(self, values: Mapping[str, Any]) -> Edit:
        """An edit whose points are given by segments."""
        plain = dict(values)
        count = self.correction.lying.frame.size
        for name in ("at", "to"):
            if name in values:
                segment = values[name]
                if isinstance(segment, bool) or not isinstance(segment, int) or not 0 <= segment < count:
                    raise FormatError(name, f"must be a line, 0 to {count - 1}", repr(segment)[:60])
                plain[name] = list(self.correction.point_on(segment))
        return edit_of(plain, "edit")
