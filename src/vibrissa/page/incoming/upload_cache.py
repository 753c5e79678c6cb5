"""Files dropped on the page: read once, kept under a key while the page is served."""

from __future__ import annotations

import hashlib
import re
import tempfile
from collections import OrderedDict
from collections.abc import Mapping
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING, Any

from vibrissa.errors import InputError, MissingError, RangeError
from vibrissa.page.incoming.dropped import DroppedReader

if TYPE_CHECKING:
    from vibrissa.texture.relief import HeightProfile
    from vibrissa.texture.surface import Gaps

LARGEST = 32 << 20  # bytes of one file
KEPT = 16
SETTLED = ("line", "x_unit", "z_unit", "level")  # what a file may leave open, as words
FLAGS = ("fill", "flip")


class UploadCache:
    """The last files that were dropped on the page."""

    def __init__(self) -> None:
        self._kept: OrderedDict[str, Gaps | HeightProfile] = OrderedDict()
        self._reader = DroppedReader()

    def put(self, name: str, content: bytes, settled: Mapping[str, str]) -> tuple[str, list[str]]:
        """Read a dropped file and keep its surface.

        Parameters
        ----------
        name : str
            As the browser gives it; only its last part is shown, only its ending is used.
        content : bytes
            The file.
        settled : mapping
            ``line``, ``x_unit``, ``z_unit``, ``level``; ``fill`` and ``flip`` where they are "1".

        Returns
        -------
        key : str
            Under which :meth:`get` gives the surface.
        notes : list of str
            What was decided on the way.

        Raises
        ------
        InputError
            If it is no texture, leaves something open, or needs more memory or time than the page gives; with the
            name it was dropped by.
        """
        shown = re.sub(r"[^\w. -]", "", PurePosixPath(PureWindowsPath(name).as_posix()).name)[-60:] or "file"
        if not 0 < len(content) <= LARGEST:
            raise RangeError(shown, f"must have 1 to {LARGEST} bytes", len(content))
        how: dict[str, Any] = {one: settled.get(one) or None for one in SETTLED}
        how |= {one: settled.get(one) == "1" for one in FLAGS}
        key = hashlib.sha256(content + repr((shown, how)).encode()).hexdigest()[:16]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"dropped{re.sub(r'[^.A-Za-z0-9_-]', '', Path(shown).suffix)}"
            path.write_bytes(content)
            try:
                surface, notes = self._reader.read(path, how)
            except InputError as error:
                raise error.rewritten(str(path), shown) from None  # the place it was read from means nothing
        self._kept[key] = surface
        self._kept.move_to_end(key)
        while len(self._kept) > KEPT:
            self._kept.popitem(last=False)
        return key, [note.replace(str(path), shown) for note in notes]

    def get(self, key: str) -> Gaps | HeightProfile:
        """Surface of a key.

        Parameters
        ----------
        key : str
            Of :meth:`put`.

        Returns
        -------
        Gaps or HeightProfile
            The surface.

        Raises
        ------
        InputError
            If nothing is kept under it.
        """
        if key not in self._kept:
            raise MissingError("texture", "must be dropped on the page", remedy="drop the file, or choose a generator")
        self._kept.move_to_end(key)
        return self._kept[key]
