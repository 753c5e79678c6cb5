"""Figures of units: a page for each, their population, what they code, how they are sorted, what they are shown."""
