"""Work that tests have stopped in the midst; of a module of its own, so that other processes find it."""

import time
from functools import partial

import numpy as np

from vibrissa.quantities import dataset
from vibrissa.study.store.result_store import StoredWork, made_of


def nap(number, pause):
    """Sleep, then give a result that only the number tells."""
    time.sleep(pause)
    noise = np.random.default_rng(number).normal(size=500)
    return {"number": number}, dataset(time=np.arange(500) / 2000, base_curvature=noise)


def naps(count, pause=0.0):
    return [StoredWork({"run": number}, partial(nap, number, pause), made_of(nap=number)) for number in range(count)]
