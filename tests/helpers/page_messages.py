"""Messages of the page, read back as its script reads them."""

import json

import numpy as np


def unpacked(message):
    """Facts and arrays of a message of ``vibrissa.page.answer.frames.packed``."""
    length = int(np.frombuffer(message, "<u4", 1)[0])
    facts = json.loads(message[4 : 4 + length])
    place, arrays = 4 + length, {}
    for name, shape in facts.pop("arrays"):
        count = int(np.prod(shape))
        arrays[name] = np.frombuffer(message, "<f4", count, place).reshape(shape)
        place += 4 * count
    return facts, arrays
