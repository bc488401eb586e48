"""Pictures."""

from historysim.basics import lazy

__getattr__, __dir__, __all__ = lazy.attach(__name__, __file__)
