"""Spectra, envelopes and correlations of signals, whatever they stand for."""
