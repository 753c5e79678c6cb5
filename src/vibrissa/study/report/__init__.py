"""The report of a study and its gallery of figures."""
