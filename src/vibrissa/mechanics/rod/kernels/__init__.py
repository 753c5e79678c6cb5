"""Compiled parts of the rod, and the arrays that they share.

The shaft, the ground, a band solver, elastic forces, contacts, the step in time. Only `rod` imports them.
"""
