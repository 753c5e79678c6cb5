"""The study file: settings, checks, schema, what a study holds.

`settings` reads and validates it.
"""
