"""What a user of the page sets: its controls, their meaning, states to start from, and their check."""
