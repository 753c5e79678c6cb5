"""Lines whose whisker a person knows: the names about them, new whiskers, and the linking that results."""
