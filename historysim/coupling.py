"""Coupling of a contact to SciPy's integrators of equations of motion.

A contact remembers its load history. Trial steps of a solver therefore start from the last accepted
state, and only accepted steps are committed.
"""

import inspect
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.arguments import ArrayLike, Floats, as_floats
from historysim.basics.wording import nearest
from historysim.errors import InputError, LoadError

if TYPE_CHECKING:
    from historysim.asperities.integration import IntegratedBody
    from historysim.asperities.state import State

__all__ = ["CoupledSolution", "solve_ivp"]


def __dir__() -> list[str]:
    return sorted(__all__)


Motion = Callable[[float, Floats, "State"], ArrayLike]
Place = Callable[[float, Floats], Mapping[str, float]]

METHODS = ("RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA")
# Parameters of scipy's solvers that are not options; the last collects all other names.
NO_OPTIONS = ("fun", "t0", "y0", "t_bound", "extraneous")
PARTS = 8  # equal parts of a step, at whose ends a reversal of the contact is detected
# fraction of the path of the contact below which a change of direction is rounding
ROUNDING = 1e-12
EDGE = 1e-3  # fraction of a step at either end, used to determine the direction of motion there
# Tolerance of a reversal point, and its least distance from the start of a step, as fractions of
# the step.
TURN_TOLERANCE, AT_BEGINNING = 1e-6, 1e-4


@attrs.frozen(eq=False)
class CoupledSolution:
    """Solution at the ends of the accepted steps."""

    t: Floats  #: (step) Times, including the start [s]
    y: Floats  #: (variable, step) The variables of the motion
    normal_load: Floats  #: (step) Of the contact [N]
    tangential_load: Floats  #: (step) Of the contact [N]
    dissipated_energy: Floats  #: (step) Energy dissipated by friction since the unloaded state [J]
    state: "State"  #: the contact at the end
    turns: int  #: steps that were shortened at a reversal of the contact
    evaluations: int  #: number of evaluations of the equations


def solve_ivp(  # noqa: PLR0913 - arguments of scipy's solve_ivp, and the contact
    motion: Motion,
    t_span: tuple[float, float],
    y0: ArrayLike,
    ensemble: "IntegratedBody",
    place: Place,
    *,
    state: "State | None" = None,
    method: str | type[Any] = "RK45",
    saturate: bool = False,
    instrument: Instrument = RIGID,
    **options: object,
) -> CoupledSolution:
    """Integrate equations of motion that include a contact; only accepted steps are committed.

    A step in which the contact reverses is shortened to the reversal point, where its forces have a
    kink: the method keeps its order, and each step is one straight load path of the contact.

    Parameters
    ----------
    motion : callable
        ``motion(t, y, contact)`` returns dy/dt; ``contact`` is the trial `State` of the contact.
        Its force on a body that moves by the tangential displacement is minus its
        ``tangential_load`` [N].
    t_span : (float, float)
        Start and end [s].
    y0 : array_like (variable)
        Initial values of the variables.
    ensemble : Ensemble
    place : callable
        ``place(t, y)`` returns the targets of the contact, as keyword arguments of
        `Ensemble.advance`, such as ``{"tangential_displacement": y[0]}``.
    state : State, optional
        Initial state of the contact, before the targets of ``place`` at the start; by default
        unloaded.
    method : str or class
        A method of `scipy.integrate.solve_ivp`, or a subclass of `scipy.integrate.OdeSolver`, with
        its ``options``.
    saturate, instrument
        As for `Ensemble.advance`.

    Raises
    ------
    InputError
        Wrong times, variables, method or options, or targets that `Ensemble.advance` cannot use.
    FrictionLimitError
        A load beyond the friction limit, also in a trial step.
    LoadError
        The solver fails; the message states time and reason.
    """
    span, start_values = as_floats("t_span", t_span), as_floats("y0", y0)
    if span.shape != (2,):
        raise InputError(f"t_span is {t_span!r}; expected two times, the start and the end")
    if start_values.ndim != 1:
        raise InputError(
            f"y0 has {start_values.ndim} dimensions; expected one, the initial values of the variables"
        )
    start_time, end_time = span.tolist()
    make = _solver_class(method, options)
    _check_targets(place(start_time, start_values))
    states, times, values = [state or ensemble.initial_state()], [], []

    def trial_state(t: float, y: Floats) -> "State":
        targets: dict[str, Any] = dict(place(t, y))
        trial: State = ensemble.advance(
            states[-1], **targets, saturate=saturate, instrument=instrument
        )
        return trial

    def accept(t: float, y: Floats) -> None:
        states.append(trial_state(t, y))
        times.append(t)
        values.append(np.array(y))

    def rate(t: float, y: Floats) -> Floats:
        derivative = as_floats("dy/dt of motion", motion(t, y, trial_state(t, y)))
        if derivative.shape != y.shape:
            # one number would be broadcast to all variables
            raise InputError(
                f"motion returned {derivative.tolist()}; expected dy/dt of each of {y.size} variables"
            )
        return derivative

    # the contact moves from the given state to its first targets in one straight path
    accept(start_time, start_values)
    solver, turns, evaluations = make(rate, start_time, start_values, end_time, **options), 0, 0
    while solver.status == "running":
        message = solver.step()
        if solver.status == "failed":
            raise LoadError(
                f"the integration fails at t = {solver.t:.6g} s: {message}; expected smoother equations"
            )
        dense = solver.dense_output()
        turn = _first_turn(dense, solver.t_old, solver.t, place)
        if turn is None:
            accept(solver.t, solver.y)
            continue
        turns, evaluations = turns + 1, evaluations + solver.nfev
        step = min(abs(solver.t - solver.t_old), abs(end_time - turn))
        accept(turn, dense(turn))
        # multistep methods must not use values from before the reversal
        solver = make(
            rate, turn, np.array(dense(turn)), end_time, **{**options, "first_step": step}
        )
    loads = {
        name: np.array([getattr(accepted, name) for accepted in states[1:]])
        for name in ("normal_load", "tangential_load", "dissipated_energy")
    }
    return CoupledSolution(
        t=np.array(times),
        y=np.array(values).T,
        **loads,
        state=states[-1],
        turns=turns,
        evaluations=evaluations + solver.nfev,
    )


def _solver_class(method: str | type[Any], options: Mapping[str, object]) -> type[Any]:
    """Return the class of a solver after checking its options."""
    from scipy import integrate

    if isinstance(method, type) and issubclass(method, integrate.OdeSolver):
        make: type[Any] = method
    elif method in METHODS:
        make = getattr(integrate, str(method))
    else:
        raise InputError(
            f"method is {method!r}; expected one of {', '.join(METHODS)}, or a class of scipy's OdeSolver"
        )
    # scipy only warns of unknown options
    option_names = [name for name in inspect.signature(make).parameters if name not in NO_OPTIONS]
    for name in options:
        if name not in option_names:
            raise InputError(
                f"{name!r} is not an option of {make.__name__}; {nearest(name, option_names)}"
            )
    return make


def _check_targets(where: object) -> None:
    if not isinstance(where, Mapping):
        raise InputError(
            f"place returned {where!r}; expected targets of the contact, such as {{'tangential_displacement': y[0]}}"
        )
    unknown = sorted(set(where) - set(INPUTS))
    if unknown:
        raise InputError(
            f"place returned {', '.join(map(repr, unknown))}; expected {', '.join(INPUTS)}"
        )


def _first_turn(
    dense: Callable[[float], Floats], start_time: float, end_time: float, targets_at: Place
) -> float | None:
    """Return the time of the first reversal of a channel of the contact within a step; None if there is none."""
    from scipy.optimize import minimize_scalar

    # the outer samples detect reversals just after the start or just before the end
    shares = np.concatenate(([0.0, EDGE], np.arange(1, PARTS) / PARTS, [1.0 - EDGE, 1.0]))
    times = start_time + shares * (end_time - start_time)
    sampled_targets = [targets_at(float(time), dense(time)) for time in times]
    turns = []
    for name in sampled_targets[0]:
        values = np.array([targets[name] for targets in sampled_targets])
        moves = np.diff(values)
        moves[np.abs(moves) <= ROUNDING * np.abs(values).max()] = 0.0
        for index in np.flatnonzero(moves[1:] * moves[:-1] < 0.0):
            sign = np.sign(moves[index])
            extreme = minimize_scalar(
                lambda time, name=name, sign=sign: -sign * targets_at(time, dense(time))[name],
                bounds=sorted(times[[index, index + 2]]),
                method="bounded",
                options={"xatol": TURN_TOLERANCE * abs(end_time - start_time) / PARTS},
            )
            if abs(extreme.x - start_time) > AT_BEGINNING * abs(end_time - start_time):
                turns.append(float(extreme.x))
                break
    return min(turns, key=lambda time: abs(time - start_time), default=None)


INPUTS = ("normal_load", "normal_displacement", "tangential_load", "tangential_displacement")
