"""The whole experiment: a study file, the chain it asks for, datasets and a report.

Internal: the public names are those of ``vibrissa`` itself.
"""
