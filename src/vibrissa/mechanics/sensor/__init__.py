"""A signal measured at the base of a whisker: strain gauge, Hall sensor, load cell.

`base_signal` analyses the record, `base_response` predicts it.
"""
