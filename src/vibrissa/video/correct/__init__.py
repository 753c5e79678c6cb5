"""Linked whiskers corrected by hand: edits, their decisions over the linker's names, and the corrected profile."""
