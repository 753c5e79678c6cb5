"""Random changes of files: of their bytes, and of the numbers and words of a text."""

import random
import struct

NUMBERS = (b"nan", b"inf", b"-1", b"0", b"1e999", b"-1e308", b"1e-320", b"", b"9" * 400, b"0x10", b"1_000", b"\xd9\xa3")
WORDS = (
    b"null",
    b"[]",
    b"{}",
    b'""',
    b"true",
    b"[[[[[[",
    b"\xff\xfe",
    b"\0",
    b"\r",
    b"\n\n",
    b",,,,",
    b'"',
    b"#",
    b"=",
)
EXTREMES = (-1, 0, 1, 2**31 - 1, -(2**31), 2**16)


def mutated(whole: bytes, chance: random.Random, text: bool) -> bytes:
    """A whole file with one to three changes; half of those of binary files in the first kilobyte."""
    data = bytearray(whole)
    for _ in range(chance.choice((1, 1, 2, 3))):
        if text and chance.random() < 0.6:
            data = bytearray(_word_changed(bytes(data), chance))
        else:
            _bytes_changed(data, chance)
        data = data or bytearray(b"\0")
    return bytes(data)


def _bytes_changed(data: bytearray, chance: random.Random) -> None:
    at = chance.randrange(min(len(data), chance.choice((1000, len(data)))))
    length = chance.randrange(1, 40)
    match chance.randrange(8):
        case 0 | 1:
            data[at] ^= 1 << chance.randrange(8)
        case 2:
            data[at] = chance.randrange(256)
        case 3:
            data[at : at + 4] = struct.pack("<i", chance.choice(EXTREMES))
        case 4:
            data[at : at + length] = bytes(length)
        case 5:
            del data[at : at + length]
        case 6:
            data[at:at] = data[max(0, at - length) : at]
        case _:
            del data[at:]


def _word_changed(data: bytes, chance: random.Random) -> bytes:
    """A text in which one number or word is another."""
    cells = data.replace(b"\n", b",").split(b",")
    cell = chance.choice(cells)
    place = data.find(cell)
    return data[:place] + chance.choice((*NUMBERS, *WORDS)) + data[place + len(cell) :]
