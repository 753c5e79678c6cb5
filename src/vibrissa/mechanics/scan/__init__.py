"""A surface scanned by a whisker: predicted motion, follicle signals, diagnostics.

`texture_prediction` takes gaps in a flat, `relief_prediction` any height profile; `sampled` gives Datasets.
Other rooms use these three and `diagnostics`.
"""
