"""Lines of all frames of a movie linked to whiskers, without marks."""
