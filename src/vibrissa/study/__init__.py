"""The whole experiment: a study file, the chain it asks for, datasets and a report."""
