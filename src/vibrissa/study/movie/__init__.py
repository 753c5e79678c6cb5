"""One movie: predicted, filmed, analysed, held against its truth."""
