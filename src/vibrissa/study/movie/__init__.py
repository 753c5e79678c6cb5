"""One movie: predicted, filmed, analysed, compared with its truth."""
