"""From surface to spikes: how a rat's whisker feels fine texture."""

__version__ = "0.1.0"
