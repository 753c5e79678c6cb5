"""``python -m vibrissa``, and what the command ``vibrissa`` calls."""

import sys


def command() -> None:
    """Run the command line; Ctrl-C ends it in one word while it is loaded, and changes nothing once it has ended."""
    try:
        from vibrissa.cli import main

        main()
    except KeyboardInterrupt:  # before there is a verb, or after it
        print("vibrissa: stopped", file=sys.stderr)
        sys.exit(130)
    finally:
        _leave_undisturbed()


def _leave_undisturbed() -> None:
    """Let no signal to stop turn a finished command into one that a signal ended."""
    import signal

    from vibrissa.sweep.stops import STOPS

    for number in STOPS:
        signal.signal(number, signal.SIG_IGN)


if __name__ == "__main__":
    command()
