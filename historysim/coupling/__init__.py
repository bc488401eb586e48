"""The contact inside other solvers: an integrator, a system of python-control, a stage under a sampled controller.

What a contact has been carried to, it remembers. All that solvers only try is therefore tried from the last accepted
state, and what they accept is committed.
"""

from historysim.basics import lazy

__getattr__, __dir__, __all__ = lazy.attach(__name__, __file__)
