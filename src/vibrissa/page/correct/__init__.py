"""The page to correct linked whiskers: the movie with its lines, all pieces over time, edits by hand and keyboard."""
