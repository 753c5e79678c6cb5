"""The whole whisker: a planar, geometrically exact rod that touches the surface wherever it reaches it.

Shaft and mesh, ground, elastic and contact forces, the step in time, damping, equilibrium, what a movie would show.
Other rooms use `rod_scan` and `rod_gap`.
"""
