"""Results exported for archives (Neurodata Without Borders)."""
