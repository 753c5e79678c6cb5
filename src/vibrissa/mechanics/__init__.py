"""The whisker's mechanics: posture, gap, vibration, and back from motion to modes."""
