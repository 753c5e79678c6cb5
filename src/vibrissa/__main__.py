"""``python -m vibrissa``."""

from vibrissa.cli import main

main()
