"""Parameter sweeps on all cores, or on a Dask cluster: maps of the transduction gain over the context of a scan.

Internal: the public names are those of ``vibrissa`` itself.
"""
