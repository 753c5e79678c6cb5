"""Results kept by what they are made of, and what could not be analysed."""
