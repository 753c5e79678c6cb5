"""What the page answers: numbers and pictures of one prediction, comparisons, and files to keep."""
