"""Old names of verbs and options, with the present ones, and common other words for options."""

from collections.abc import Collection

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

SYNONYMS = {  # what an option may be called elsewhere; of several, the one that the verb takes
    "--velocity": ("--speed", "--max-speed"),
    "--fps": ("--frame-rate",),
    "--rate": ("--frame-rate", "--sampling-rate"),
    "--fs": ("--sampling-rate", "--frame-rate"),
    "--sample-rate": ("--sampling-rate", "--frame-rate"),
    "--px": ("--pixel-size",),
    "--resolution": ("--pixel-size",),
    "--roi": ("--region",),
    "--crop": ("--region",),
    "--first-frame": ("--start",),
    "--last-frame": ("--stop",),
    "--end": ("--stop",),
    "--angle": ("--base-angle",),
    "--theta": ("--base-angle",),
    "--height": ("--base-distance",),
    "--epsilon": ("--contact",),
    "--mu": ("--friction",),
    "--zeta": ("--damping",),
    "--length": ("--whisker.length", "--grating-length", "--duration"),
    "--modulus": ("--whisker.youngs-modulus",),
    "--stiffness": ("--whisker.youngs-modulus",),
    "--width": ("--gap-width", "--bin-width"),
    "--depth": ("--gap-depth",),
    "--surface": ("--texture",),
    "--bin-size": ("--bin-width",),
    "--n-trials": ("--trials",),
    "--repeats": ("--trials",),
    "--p-value": ("--level",),
    "--output": ("--out",),
    "--save": ("--out",),
    "--figure": ("--picture", "--plot"),
    "--jobs": ("--workers",),
    "--threads": ("--workers",),
    "--random-seed": ("--seed",),
    "--force": ("--overwrite",),
}


def near_name(option: str, taken: Collection[str]) -> str | None:
    """The option of a verb that is called by another word elsewhere.

    Parameters
    ----------
    option : str
        As typed.
    taken : collection of str
        Options that the verb takes.

    Returns
    -------
    str or None
        ``--speed`` for ``--velocity``; None if the verb takes the word itself, or no option of that meaning.
    """
    word = option.replace("_", "-")
    return None if word in taken else next((name for name in SYNONYMS.get(word, ()) if name in taken), None)


def new_name(verb: str, option: str) -> str | None:
    """The present name of an option that was renamed; None if it was not.

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
