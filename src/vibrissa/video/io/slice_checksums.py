"""Checksums of FFV1's slices: FFmpeg hides a slice whose checksum fails, and gives the frame as if it were whole."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass

# FFV1's CRC takes the highest bit of each byte first, zlib's the lowest: bytes are turned round before it
_TURNED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_SIZE, _CHECKED = 3, 8  # [bytes] of a slice's footer: its size alone; its size, status and checksum
_STARTS = 0, 0x5E31029E  # of the CRC, in the two ways of error detection that the format knows


@dataclass
class SliceChecksums:
    """Whether the frames of an FFV1 stream are as they were written.

    From version 3 on, the slices of a frame have checksums unless the encoder left them out. The first frame shows
    which it is: without them, shorter footers fill it exactly.

    Attributes
    ----------
    extradata : bytes
        Configuration of the stream; empty in versions 0 and 1, which have no checksums.
    """

    extradata: bytes
    failed: bool = False
    _start: int | None = None
    _seen: bool = False

    @property
    def present(self) -> bool:
        """Whether the stream has checksums, as its first frame showed."""
        return self._start is not None

    def hold(self, packet: bytes) -> bool:
        """Whether all checksums of a frame hold; True where there are none.

        Parameters
        ----------
        packet : bytes
            The frame as it is coded, the first of the stream first.

        Returns
        -------
        bool
            If False, ``failed`` is True from then on.
        """
        if not self._seen:
            self._seen, self._start = True, self._start_of(packet)
        if self._start is not None and not _hold(packet, self._start):
            self.failed = True
        return not self.failed

    def _start_of(self, first: bytes) -> int | None:
        """Value from which the CRC starts; None without checksums."""
        if not self.extradata or all(_slices(first, _SIZE)):
            return None
        return next((start for start in _STARTS if _hold(first, start)), _STARTS[0])


def _hold(packet: bytes, start: int) -> bool:
    # each CRC is stored such that the remainder over its slice and itself is the start value again
    return all(one and _remainder(one, start) == start for one in _slices(packet, _CHECKED))


def _slices(packet: bytes, footer: int) -> Iterator[bytes]:
    """Slices of a frame with their footers, the last first; an empty one where a size is wrong."""
    end = len(packet)
    while end > 0:
        at = end - footer
        size = int.from_bytes(packet[at : at + 3], "big") + footer if at >= 0 else end + 1
        if size > end:
            yield b""
            return
        yield packet[end - size : end]
        end -= size


def _remainder(data: bytes, start: int) -> int:
    """CRC-32 from a start value; both in zlib's order of bits."""
    return zlib.crc32(data.translate(_TURNED), start ^ 0xFFFFFFFF) ^ 0xFFFFFFFF
