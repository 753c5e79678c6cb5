"""The paper's numbers beside those of a study, and the verdict on each."""
