"""Equations of motion with a contact in them, integrated by the solvers of scipy: only accepted steps are remembered.

The stages of a step, and the steps that a solver rejects, are trials: each starts from the state at the end of the last
accepted step. A step in which the contact turns round is cut at its turning point, so that the contact is carried there
and each piece of the motion is one straight path of the contact.
"""

import inspect
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.basics.wording import nearest
from historysim.coupling.control_system import INPUTS
from historysim.errors import InputError, LoadError

if TYPE_CHECKING:
    from historysim.asperities.ensemble import Ensemble
    from historysim.asperities.state import EnsembleState

Motion = Callable[[float, Floats, "EnsembleState"], npt.ArrayLike]
Place = Callable[[float, Floats], Mapping[str, float]]

METHODS = ("RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA")
GIVEN = ("fun", "t0", "y0", "t_bound", "extraneous")
"""Parameters of scipy's solvers that are no options; the last takes all other names."""
LOOKS = 8
"""Equal parts of a step, at the ends of which it is looked whether the contact has turned round."""
ROUNDING = 1e-12
"""Share of the way of the contact below which a change of its direction is rounding."""
EDGE = 1e-3
"""Share of a step at either end, in which it is seen which way the contact goes there."""
CLOSE, BEGINNING = 1e-6, 1e-4
"""Share of a step to which a turning point is found; and from its beginning, within which it is that beginning."""


@attrs.frozen(eq=False)
class CoupledSolution:
    """What a solver has found, at the ends of its accepted steps.

    Attributes
    ----------
    t : array (step)
        Times [s], from the beginning on.
    y : array (variable, step)
        The variables of the motion.
    normal_load, tangential_load : array (step)
        Totals of the contact [N].
    dissipated_energy : array (step)
        Energy that friction has taken since the state at the beginning was unloaded [J].
    state : EnsembleState
        The contact at the end.
    turns : int
        Steps that were cut where the contact turned round.
    evaluations : int
        How often the equations were evaluated.
    """

    t: Floats
    y: Floats
    normal_load: Floats
    tangential_load: Floats
    dissipated_energy: Floats
    state: "EnsembleState"
    turns: int
    evaluations: int


def solve_ivp(  # noqa: PLR0913 - those of scipy's solve_ivp, and the contact
    motion: Motion,
    t_span: tuple[float, float],
    y0: npt.ArrayLike,
    ensemble: "Ensemble",
    place: Place,
    *,
    state: "EnsembleState | None" = None,
    method: str | type[Any] = "RK45",
    saturate: bool = False,
    instrument: Instrument = RIGID,
    **options: object,
) -> CoupledSolution:
    """Integrate equations of motion that a contact is part of, and commit the accepted steps alone.

    Parameters
    ----------
    motion : callable
        ``motion(t, y, contact)`` returns dy/dt; ``contact`` is the `EnsembleState` that the contact would be in, which
        has ``tangential_load``, ``normal_load`` [N] and stiffnesses. The contact opposes the motion: its force on a
        body that moves by the tangential displacement is minus the tangential load.
    t_span : (float, float)
        Beginning and end [s].
    y0 : array_like (variable)
        The variables at the beginning.
    ensemble : Ensemble
    place : callable
        ``place(t, y)`` returns where the contact is then: what `Ensemble.advance` takes, such as
        ``{"tangential_displacement": y[0]}``.
    state : EnsembleState, optional
        The contact at the beginning, where ``place(t, y)`` says; the unloaded one by default.
    method : str or class
        A method of `scipy.integrate.solve_ivp`, or a class of its kind of solvers.
    saturate, instrument
        As for `Ensemble.advance`.
    **options
        Of the solver: ``rtol``, ``atol``, ``max_step``, ….

    Returns
    -------
    CoupledSolution

    Raises
    ------
    InputError
        What is no time, no variable, no method, no option of it, or what `Ensemble.advance` cannot use.
    FrictionLimitError
        A load beyond the friction limit, also of a trial.
    LoadError
        The solver cannot go on; the message says where, and why.

    Notes
    -----
    A method of order p keeps it where the forces are smooth. Those of a contact have a kink where it turns round, which
    is why steps end there.
    """
    span = checked("t_span", t_span)
    if span.shape != (2,):
        raise InputError(f"t_span is {t_span!r}; expected two times, the beginning and the end")
    begin, end = (float(time) for time in span)
    make = _solver_class(method)
    _check_options(make, options)
    given: dict[str, Any] = {"saturate": saturate, "instrument": instrument}
    start = checked("y0", y0)
    if start.ndim != 1:
        raise InputError(f"y0 has {start.ndim} dimensions; expected one, of the variables at the beginning")
    where = place(begin, start)
    _check_targets(where)

    def moved(contact: "EnsembleState", targets: Mapping[str, float]) -> "EnsembleState":
        chosen: dict[str, Any] = {**targets, **given}
        return ensemble.advance(contact, **chosen)

    present = moved(state or ensemble.initial_state(), where)

    def rate(t: float, y: Floats) -> Floats:
        # `present` is that of the last accepted step, whatever has been tried since
        found = checked("dy/dt of motion", motion(t, y, moved(present, place(t, y))))
        if found.shape != y.shape:
            # one number would pass for all
            raise InputError(f"motion returned {found.tolist()}; expected dy/dt of each of {y.size} variables")
        return found

    solver = make(rate, begin, start, end, **options)
    times, values, states, turns, evaluations = [begin], [solver.y.copy()], [present], 0, 0
    while solver.status == "running":
        message = solver.step()
        if solver.status == "failed":
            raise LoadError(f"the integration fails at t = {solver.t:.6g} s: {message}; expected smoother equations")
        time, value = solver.t, solver.y
        dense = solver.dense_output()
        turn = _first_turn(dense, solver.t_old, time, place)
        if turn is not None:
            time, value, turns = turn, dense(turn), turns + 1
            evaluations += solver.nfev
            step = min(abs(solver.t - solver.t_old), abs(end - turn))
        present = moved(present, place(time, value))
        times.append(time)
        values.append(np.array(value))
        states.append(present)
        if turn is not None:
            solver = make(rate, time, np.array(value), end, **{**options, "first_step": step})
    return CoupledSolution(
        t=np.array(times),
        y=np.array(values).T,
        normal_load=np.array([one.normal_load for one in states]),
        tangential_load=np.array([one.tangential_load for one in states]),
        dissipated_energy=np.array([one.dissipated_energy for one in states]),
        state=present,
        turns=turns,
        evaluations=evaluations + solver.nfev,
    )


def _solver_class(method: str | type[Any]) -> type[Any]:
    from scipy import integrate

    if isinstance(method, type) and issubclass(method, integrate.OdeSolver):
        return method
    if method not in METHODS:
        raise InputError(f"method is {method!r}; expected one of {', '.join(METHODS)}, or a class of scipy's OdeSolver")
    found: type[Any] = getattr(integrate, str(method))
    return found


def _check_targets(where: object) -> None:
    """Check that what ``place`` returned are targets of the contact by their names."""
    if not isinstance(where, Mapping):
        raise InputError(
            f"place returned {where!r}; expected targets of the contact, such as {{'tangential_displacement': y[0]}}"
        )
    unknown = sorted(set(where) - set(INPUTS))
    if unknown:
        raise InputError(f"place returned {', '.join(map(repr, unknown))}; expected {', '.join(INPUTS)}")


def _check_options(make: type[Any], options: Mapping[str, object]) -> None:
    """Check that a solver has options of these names; scipy's own warns of another one, and goes on without it."""
    known = [name for name in inspect.signature(make).parameters if name not in GIVEN]
    for name in options:
        if name not in known:
            raise InputError(f"{name!r} is no option of {make.__name__}; {nearest(name, known)}")


def _first_turn(dense: Callable[[float], Floats], start: float, end: float, place: Place) -> float | None:
    """Return when a channel of the contact first turns round within a step; None where none does."""
    from scipy.optimize import minimize_scalar

    # a turn just behind the beginning, or before the end, is seen by the way the contact goes there
    shares = np.concatenate(([0.0, EDGE], np.arange(1, LOOKS) / LOOKS, [1.0 - EDGE, 1.0]))
    times = start + shares * (end - start)
    looks = [place(float(time), dense(time)) for time in times]
    found = []
    for name in looks[0]:
        values = np.array([one[name] for one in looks])
        moves = np.diff(values)
        moves[np.abs(moves) <= ROUNDING * np.abs(values).max()] = 0.0
        for first in np.flatnonzero(moves[1:] * moves[:-1] < 0.0):
            sign = np.sign(moves[first])
            extreme = minimize_scalar(
                lambda time, name=name, sign=sign: -sign * place(time, dense(time))[name],
                bounds=sorted(times[[first, first + 2]]),
                method="bounded",
                options={"xatol": CLOSE * abs(end - start) / LOOKS},
            )
            if abs(extreme.x - start) > BEGINNING * abs(end - start):
                found.append(float(extreme.x))
                break
    return min(found, key=lambda time: abs(time - start), default=None)
