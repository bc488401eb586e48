"""One contact without memory: pure functions of scalars or numpy arrays, in SI."""

from historysim.basics import lazy

__getattr__, __dir__, __all__ = lazy.attach(__name__, __file__)
