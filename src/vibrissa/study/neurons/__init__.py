"""Neurons of a study: a simulated population, or recorded units."""
