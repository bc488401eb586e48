"""What one caller at a time may use: another thread that comes in meanwhile gets an error, and nothing is damaged."""

from historysim.errors import InputError


class OneAtATime:
    """The one place at an object that is changed in place; ``with`` takes it, and gives it back.

    It costs a third of a lock. Where that still counts, ``del place.free[0]`` takes it (an IndexError: it is taken),
    and ``place.free.append(None)`` gives it back: single operations of a list, which no thread comes between. `what`
    names the object, and how to have several: "the stepper: …".
    """

    __slots__ = ("_what", "free")

    def __init__(self, what: str) -> None:
        self._what = what
        self.free = [None]

    def taken(self) -> InputError:
        """Return the error of whoever comes second."""
        what, mend = self._what.split(": ", 1)
        return InputError(f"{what} is in use, by another thread or by a law that it asks; expected {mend}")

    def __enter__(self) -> None:
        try:
            del self.free[0]
        except IndexError:
            raise self.taken() from None

    def __exit__(self, *_: object) -> None:
        self.free.append(None)

    def another(self) -> "OneAtATime":
        """Return that of a copy of the object."""
        return OneAtATime(self._what)
