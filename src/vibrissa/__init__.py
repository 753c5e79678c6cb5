"""From surface to spikes: how a rat's whisker feels fine texture.

``import vibrissa as vb`` gives the public names of ``__init__.pyi``; each is loaded when it is first used. Every
sub-package is internal.
"""

import lazy_loader

__version__ = "0.1.0"

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    """Load a public name, or suggest the nearest."""
    try:
        return _load(name)
    except AttributeError:
        from vibrissa.errors import did_you_mean

        raise AttributeError(
            f"vibrissa has no name {name!r}; {did_you_mean(name, __all__, 'see dir(vibrissa)')}"
        ) from None
