"""Equilibria of a whisker pressed on a surface, by Eq. 1.

The contact law, the shooting integrator, the table of all equilibria, the profile on the flat and on an edge, one gap.
Other rooms use `profile`, `edge_contact` and `gap`; the integrators serve this package.
"""
