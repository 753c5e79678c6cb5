"""Spectra, envelopes and correlations of signals.

Internal: the public names are those of ``vibrissa`` itself.
"""
