"""A study file made from clicks on a movie's first frame."""
