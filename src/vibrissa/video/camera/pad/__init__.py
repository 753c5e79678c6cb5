"""Whole whisking scenes before the virtual camera: head, pads, paw and pole, with known truth."""
