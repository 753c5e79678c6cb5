"""What the words of the command line mean: options, their units and old names, and how a refusal speaks of them."""
