"""From textures, scanned in one way, to what populations of rival codes say; decoders taught there, asked elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict_all
from vibrissa.neural.coding.codes import Code, EnvelopeCode, EventCode, SpectrumCode, kinetic_events
from vibrissa.neural.coding.decoder import all_bins, mean_rate, pattern_scores, poisson_scores
from vibrissa.neural.simulated.population import drawn_units
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit

if TYPE_CHECKING:
    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.texture.surface import Gaps
    from vibrissa.whisker import Whisker

RATE, MODES = 4000.0, 4  # [Hz], [1]
DISTANCE = 5e-3  # [m] of the point from the base, as in the paper's replay
LEAD_IN = 2e-3  # [m] left away at the start, where the whisker comes from rest
STEP = 1e-3  # [m] of distance in a bin: the paper's 10 ms at 0.1 m/s
UNITS = 16
BANDS = (30.0, 600.0)  # [Hz] that the spectrum's units cover
EVENT_QUANTILES = (0.5, 0.98)  # of the sizes of all events, between which the thresholds of the event units lie


@dataclass(frozen=True, kw_only=True)
class ScanWay:
    """One way to scan.

    Attributes
    ----------
    arm : str
        What differs from the way that teaches: ``taught`` (nothing), ``speed``, ``height`` or ``angle``.
    posture : Posture
        How the whisker is held.
    height : float
        Of the base above the substrate, over L.
    speed : float
        [m/s].
    """

    arm: str
    posture: Posture
    height: float
    speed: float


def motions(
    whisker: Whisker, textures: Sequence[Gaps], length: float, way: ScanWay, damping: float
) -> tuple[Array, float]:
    """Displacement near the base while the same stretch of each texture passes, (K, T) [m]; first resonance [Hz].

    Parameters
    ----------
    whisker : Whisker
        What scans.
    textures : sequence of Gaps
        K of them.
    length : float
        Of each texture [m].
    way : ScanWay
        How it is scanned.
    damping : float
        ζ.

    Returns
    -------
    moved : (K, T) array
        Displacement [m].
    first : float
        First resonance [Hz].
    """
    predictions = predict_all(whisker, way.posture, textures, Scan(speed=way.speed, damping=damping), n_modes=MODES)
    t = np.arange(LEAD_IN / way.speed, length / way.speed, 1 / RATE)
    point = np.array([1 - DISTANCE / whisker.length])
    found = np.array([one.displacement(t, point)[:, 0] for one in predictions]) * whisker.length
    return found, float(predictions[0].omega[0] / (2 * np.pi))


@dataclass(frozen=True, kw_only=True)
class Population:
    """Units of one code.

    Attributes
    ----------
    code : Code
        What drives them.
    baseline : (U,) array
        Rates at rest [Hz].
    gain : (U,) array
        Spikes per unit of drive.
    """

    code: Code
    baseline: Array
    gain: Array

    def expected(self, moved: Array, n_bins: int) -> Array:
        """Spikes expected of each unit in equal parts of each motion, (K, U, n_bins).

        Parameters
        ----------
        moved : (K, T) array
            Motions [m].
        n_bins : int
            Parts of each motion.

        Returns
        -------
        (K, U, n_bins) array
            Expected numbers of spikes.
        """
        drive = np.array([self.code.drive(one, RATE, n_bins) for one in moved])
        rest = self.baseline * moved.shape[1] / RATE / n_bins
        return np.asarray(self.gain[:, None] * drive + rest[:, None], float)


def populations(taught: Array, *, rng: np.random.Generator) -> dict[str, Population]:
    """Populations of three codes that fire alike often over the motions that teach, (K, T).

    The envelope's units have the paper's thresholds and slopes. Those of the other codes have the same rates at rest,
    and gains that give every one of them the same number of spikes besides, together as many as the envelope's.

    Parameters
    ----------
    taught : (K, T) array
        Motions that teach [m].
    rng : Generator
        Source of randomness.

    Returns
    -------
    dict of Population
        By code.
    """
    drawn = drawn_units("SU", UNITS, UNITS, rng)
    rest = drawn["true_baseline"]
    pairs = zip(drawn["true_threshold"], drawn["true_slope"], strict=True)
    units = tuple(ThresholdLinearUnit(threshold=a, slope=s, latency=0.0) for a, s in pairs)
    sizes = np.concatenate([kinetic_events(one, RATE)[1] for one in taught])
    codes: dict[str, Code] = {
        "envelope": EnvelopeCode(units=units),
        "spectrum": SpectrumCode(edges=np.geomspace(*BANDS, UNITS + 1)),
        "events": EventCode(thresholds=np.quantile(sizes, np.linspace(*EVENT_QUANTILES, UNITS))),
    }
    sums = {name: np.mean([code.drive(one, RATE, 1)[:, 0] for one in taught], 0) for name, code in codes.items()}
    spikes = sums["envelope"].mean()
    gains = {name: np.ones(UNITS) if name == "envelope" else spikes / drive for name, drive in sums.items()}
    return {name: Population(code=code, baseline=rest, gain=gains[name]) for name, code in codes.items()}


class Decoder(NamedTuple):
    """What is read of a population, and what the reader knows of the way it was scanned.

    Attributes
    ----------
    code : str
        The population.
    bins : {"distance", "time"}
        Bins of distance scanned take the speed for known; bins of time do not.
    read : callable
        What of the bins is used.
    pattern : bool
        Whether only shares of the sum over what is read count, so that any gain will do.
    lasting : bool
        Whether the reader allows for the fact that bins of the same distance last longer at a lower speed.
    """

    code: str
    bins: Literal["distance", "time"]
    read: Callable[[Array], Array]
    pattern: bool = False
    lasting: bool = True

    def scores(self, learnt: Array, weights: Array, seen: Array, exposure: float) -> Array:
        """Log likelihood of each texture, (T, K).

        Parameters
        ----------
        learnt : (T, U, B) array
            Counts of the trials that teach.
        weights : (K, T) array
            1 where a trial is of a texture, else 0.
        seen : (T, U, B) array
            Counts of the trials that are asked.
        exposure : float
            How long the scan that is asked lasts, over that which teaches.

        Returns
        -------
        (T, K) array
            Log likelihoods.
        """
        first, second = self.read(learnt), self.read(seen)
        if self.pattern:
            return pattern_scores(first, weights, second)
        return poisson_scores(first, weights, second, exposure if self.lasting else 1.0)


def _units(counts: Array) -> Array:
    """Total of each unit, laid along the last axis, so that their shares are a pattern."""
    return counts.sum(-1)[:, None, :]


CLAIM = "envelope over distance, any gain"  # the paper's: its course over the texture stays, whatever its size
DECODERS: dict[str, Decoder] = {
    CLAIM: Decoder("envelope", "distance", all_bins, pattern=True),
    "envelope over distance": Decoder("envelope", "distance", all_bins),
    "envelope over time": Decoder("envelope", "time", all_bins, lasting=False),
    "mean rate": Decoder("envelope", "distance", mean_rate),
    "spectrum": Decoder("spectrum", "distance", _units),
    "spectrum, any gain": Decoder("spectrum", "distance", _units, pattern=True),
    "events over distance": Decoder("events", "distance", all_bins, lasting=False),
    "events over distance, any gain": Decoder("events", "distance", all_bins, pattern=True),
    "event sizes": Decoder("events", "distance", _units, lasting=False),
}

Expected = dict[tuple[str, str], Array]  # by code and bins


def expected_everywhere(
    people: dict[str, Population], moved: Array, length: float, speed: float, base: float
) -> Expected:
    """Spikes expected of every population in bins of distance, and of time as long as those at the base speed.

    Parameters
    ----------
    people : dict of Population
        By code.
    moved : (K, T) array
        Motions [m].
    length : float
        Of each texture [m].
    speed : float
        Of the scan [m/s].
    base : float
        Of the scan that teaches [m/s].

    Returns
    -------
    dict
        (code, bins) → (K, U, B) array.
    """
    n_place = round((length - LEAD_IN) / STEP)
    n_time = max(2, round(n_place * base / speed))
    wanted = dict.fromkeys((one.code, one.bins) for one in DECODERS.values())  # in order: trials are drawn in it
    return {
        (code, bins): people[code].expected(moved, n_place if bins == "distance" else n_time) for code, bins in wanted
    }


def accuracies(taught: Expected, asked: Expected, exposure: float, n_trials: int, *, rng: np.random.Generator) -> Array:
    """Share of trials answered rightly by each decoder, (len(DECODERS),).

    Parameters
    ----------
    taught, asked : dict
        Spikes expected of K textures where the decoders learn, and where they are asked; Poisson trials are drawn.
    exposure : float
        How long the scan that is asked lasts, over that which teaches.
    n_trials : int
        Trials of each texture, to learn from and to be asked.
    rng : Generator
        Source of randomness.

    Returns
    -------
    (D,) array
        In the order of ``DECODERS``.
    """
    n_textures = len(next(iter(taught.values())))
    label = np.repeat(np.arange(n_textures), n_trials)
    weights = (label == np.arange(n_textures)[:, None]).astype(float)
    learnt, seen = ({key: rng.poisson(one[label]).astype(float) for key, one in of.items()} for of in (taught, asked))
    shares = np.empty(len(DECODERS))
    for k, decoder in enumerate(DECODERS.values()):
        first, second = learnt[decoder.code, decoder.bins], seen[decoder.code, decoder.bins]
        n = min(first.shape[-1], second.shape[-1])  # in time, a scan may end before what was learnt does
        shares[k] = np.mean(decoder.scores(first[..., :n], weights, second[..., :n], exposure).argmax(1) == label)
    return shares
