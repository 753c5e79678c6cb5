"""Verbs of spikes: stimuli replayed, traces sorted, the quality, drive and the code of units."""

from vibrissa.cli.spikes.coding import demodulation, drives, information
from vibrissa.cli.spikes.discriminate import discriminate
from vibrissa.cli.spikes.neural import neural
from vibrissa.cli.spikes.quality import quality
from vibrissa.cli.spikes.replay import replay
from vibrissa.cli.spikes.robustness import robustness
from vibrissa.cli.spikes.sort import sort
from vibrissa.cli.spikes.trials_needed import trials_needed
from vibrissa.cli.spikes.whisker_maps import glm, surround

GROUP = "Spikes"
VERBS = (
    replay, sort, quality, neural, surround, glm, demodulation, drives, information, discriminate, robustness,
    trials_needed
)  # fmt: skip
