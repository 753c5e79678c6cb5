"""Quasi-static response of the held profile to the motion of its contact.

Projection on the modes, the response to an edge (polynomials of the excursion), the response to any relief.
Other rooms reach it through predictions (`mechanics.scan`).
"""
