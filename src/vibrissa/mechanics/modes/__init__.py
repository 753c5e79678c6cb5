"""Resonant modes of a pinned whisker: straight, and about its curved profile.

`straight` gives the paper's modes (Bessel functions), `curved` those about Eq. 1's solution, `shift` compares the two.
Other rooms choose between them by `basis`.
"""
