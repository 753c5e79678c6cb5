"""The run of a study: plan, stages, provenance."""
