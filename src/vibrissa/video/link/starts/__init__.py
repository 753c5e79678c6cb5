"""What a linking starts from: tracklets, whiskers that they show, and those of windows of a long movie."""
