"""Whiskers found in one image: ridges, and the lines that they form."""
