"""Bodies of requests: their length and their time are limited, whatever their headers say."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from starlette.requests import Request

PATIENCE = 20.0  # [s] in which a body must have come
MOST_DIGITS = 12  # of a length


class RefusedBodyError(Exception):
    """A body that is not read, or not read to its end.

    Parameters
    ----------
    code : int
        Status of the answer.
    line : str
        What it says.
    """

    def __init__(self, code: int, line: str) -> None:
        super().__init__(line)
        self.code, self.line = code, line


async def body_of(request: Request, largest: int) -> bytes:
    """Body of a request, counted while it comes.

    Parameters
    ----------
    request : Request
        Of a file.
    largest : int
        Bytes that it may have.

    Returns
    -------
    bytes
        All of it.

    Raises
    ------
    RefusedBodyError
        If it is too long, comes too slowly, breaks off, or says its length in two ways.
    """
    from starlette.requests import ClientDisconnect

    lengths, chunked = request.headers.getlist("content-length"), "transfer-encoding" in request.headers
    if len(lengths) + chunked != 1 or not all(_is_length(one) for one in lengths):
        raise RefusedBodyError(400, "a file must come with one length, or in chunks, not both")
    parts, count = [], int(lengths[0]) if lengths else 0
    try:
        async with asyncio.timeout(PATIENCE):
            if count <= largest:
                count = 0
                async for part in request.stream():
                    parts.append(part)
                    if (count := count + len(part)) > largest:
                        break
    except TimeoutError as error:
        raise RefusedBodyError(408, f"a file must come within {PATIENCE:g} s") from error
    except ClientDisconnect as error:
        raise RefusedBodyError(400, "the file broke off") from error
    if count > largest:
        raise RefusedBodyError(413, f"a dropped file must have at most {largest >> 20} MB")
    return b"".join(parts)


def _is_length(text: str) -> bool:
    return text.isascii() and text.isdecimal() and len(text) <= MOST_DIGITS
