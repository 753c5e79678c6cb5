"""Figures of units: a page for each, their population, what they code, sorted units, the command replayed."""
