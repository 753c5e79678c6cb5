"""``python -m vibrissa``."""

from vibrissa.cli import main

if __name__ == "__main__":
    main()
