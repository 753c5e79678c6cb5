"""Names of verbs and options that are no more, and those that took their place."""

OLD_VERBS = {"sweep": "map", "sweeps": "recordings", "tracks": "import-tracks", "whisk": "whisking", "base": "sensor"}
OLD_OPTIONS = {  # by verb; "" for every verb
    "": {"--scan-speed": "--speed", "--count": "--n-modes"},
    "export": {"--nwb": "--out", "--start": "--session-start"},
    "import-tracks": {"--which": "--only-identity"},
    "map": {"--node": "--point"},
    "pick": {"--seed": "--seed-point", "--scale": "--scale-point", "--force": "--overwrite"},
    "replay": {
        "--speed": "--max-speed",
        "--travel": "--max-travel",
        "--acceleration": "--max-acceleration",
        "--scale": "--factor",
    },
    "robustness": {"--height": "--height-ratio", "--angle": "--angle-ratio"},
    "scan": {"--spikes": "--simulate-units", "--level": "--levelling", "--flip": "--reverse"},
    "sensor": {"--unit": "--signal-unit", "--start": "--texture-start"},
    "sort": {"--units": "--n-units"},
    "track": {
        "--seed": "--seed-point",
        "--threshold": "--least-contrast",
        "--whisker-length": "--whisker.length",
    },
    "whisker": {"--resonances": "--resonance-file", "--cone-angle": "--whisker.cone-angle"},
}


def new_name(verb: str, option: str) -> str | None:
    """The option that took the place of one that is no more; None if it never was one.

    Parameters
    ----------
    verb, option : str
        As typed.

    Returns
    -------
    str or None
        ``--speed`` for ``--scan-speed``.
    """
    return OLD_OPTIONS.get(verb, {}).get(option) or OLD_OPTIONS[""].get(option)
