"""Where each linked whisker runs, and lines cut where they go over from one whisker to another."""
