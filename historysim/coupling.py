"""The contact inside other solvers: SciPy's integrators, a system of python-control, a stage under a controller.

What a contact has been carried to, it remembers. All that solvers only try is therefore tried from the last accepted
state, and what they accept is committed.
"""

import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.arguments import ArrayLike, Floats, checked, scalar
from historysim.basics.wording import nearest
from historysim.errors import InputError, LoadError

if TYPE_CHECKING:
    import control

    from historysim.asperities.ensemble import Ensemble
    from historysim.asperities.state import State

__all__ = ["CoupledSolution", "StageMotion", "contact_system", "controlled_stage", "solve_ivp"]


def __dir__() -> list[str]:
    return sorted(__all__)


Motion = Callable[[float, Floats, "State"], ArrayLike]
Place = Callable[[float, Floats], Mapping[str, float]]

METHODS = ("RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA")
# Parameters of scipy's solvers that are no options; the last takes all other names.
NO_OPTIONS = ("fun", "t0", "y0", "t_bound", "extraneous")
PARTS = 8  # equal parts of a step, at the ends of which it is looked whether the contact has turned round
ROUNDING = 1e-12  # share of the way of the contact below which a change of its direction is rounding
EDGE = 1e-3  # share of a step at either end, in which it is seen which way the contact goes there
# Share of a step to which a turning point is found; and from its beginning, within which it is that beginning.
TURN_TOLERANCE, AT_BEGINNING = 1e-6, 1e-4


@attrs.frozen(eq=False)
class CoupledSolution:
    """What a solver has found, at the ends of its accepted steps."""

    t: Floats  #: (step) Times from the beginning on [s]
    y: Floats  #: (variable, step) The variables of the motion
    normal_load: Floats  #: (step) Of the contact [N]
    tangential_load: Floats  #: (step) Of the contact [N]
    dissipated_energy: Floats  #: (step) What friction has taken since the contact was unloaded [J]
    state: "State"  #: the contact at the end
    turns: int  #: steps that were cut where the contact turned round
    evaluations: int  #: how often the equations were evaluated


def solve_ivp(  # noqa: PLR0913 - those of scipy's solve_ivp, and the contact
    motion: Motion,
    t_span: tuple[float, float],
    y0: ArrayLike,
    ensemble: "Ensemble",
    place: Place,
    *,
    state: "State | None" = None,
    method: str | type[Any] = "RK45",
    saturate: bool = False,
    instrument: Instrument = RIGID,
    **options: object,
) -> CoupledSolution:
    """Integrate equations of motion that a contact is part of, and commit the accepted steps alone.

    A step in which the contact turns round is cut there, since its forces have a kink: so a method keeps its order, and
    each piece of the motion is one straight path of the contact.

    Parameters
    ----------
    motion : callable
        ``motion(t, y, contact)`` returns dy/dt; ``contact`` is the `State` that the contact would be in. Its
        force on a body that moves by the tangential displacement is minus its ``tangential_load`` [N].
    t_span : (float, float)
        Beginning and end [s].
    y0 : array_like (variable)
        The variables at the beginning.
    ensemble : Ensemble
    place : callable
        ``place(t, y)`` returns where the contact is then: what `Ensemble.advance` takes, such as
        ``{"tangential_displacement": y[0]}``.
    state : State, optional
        The contact at the beginning, where ``place(t, y)`` says; the unloaded one by default.
    method : str or class
        A method of `scipy.integrate.solve_ivp`, or a class of its kind of solvers; ``options`` are its options.
    saturate, instrument
        As for `Ensemble.advance`.

    Raises
    ------
    InputError
        What is no time, no variable, no method, no option of it, or what `Ensemble.advance` cannot use.
    FrictionLimitError
        A load beyond the friction limit, also of a trial.
    LoadError
        The solver cannot go on; the message says where, and why.
    """
    span, start = checked("t_span", t_span), checked("y0", y0)
    if span.shape != (2,):
        raise InputError(f"t_span is {t_span!r}; expected two times, the beginning and the end")
    if start.ndim != 1:
        raise InputError(f"y0 has {start.ndim} dimensions; expected one, of the variables at the beginning")
    begin, end = span.tolist()
    make = _solver_class(method, options)
    _check_targets(place(begin, start))
    states, times, values = [state or ensemble.initial_state()], [], []

    def tried(t: float, y: Floats) -> "State":
        targets: dict[str, Any] = dict(place(t, y))
        after: State = ensemble.advance(states[-1], **targets, saturate=saturate, instrument=instrument)
        return after

    def accept(t: float, y: Floats) -> None:
        states.append(tried(t, y))
        times.append(t)
        values.append(np.array(y))

    def rate(t: float, y: Floats) -> Floats:
        found = checked("dy/dt of motion", motion(t, y, tried(t, y)))
        if found.shape != y.shape:
            # one number would pass for all
            raise InputError(f"motion returned {found.tolist()}; expected dy/dt of each of {y.size} variables")
        return found

    # the contact goes to its first place straight from the state that is given
    accept(begin, start)
    solver, turns, evaluations = make(rate, begin, start, end, **options), 0, 0
    while solver.status == "running":
        message = solver.step()
        if solver.status == "failed":
            raise LoadError(f"the integration fails at t = {solver.t:.6g} s: {message}; expected smoother equations")
        dense = solver.dense_output()
        turn = _first_turn(dense, solver.t_old, solver.t, place)
        if turn is None:
            accept(solver.t, solver.y)
            continue
        turns, evaluations = turns + 1, evaluations + solver.nfev
        step = min(abs(solver.t - solver.t_old), abs(end - turn))
        accept(turn, dense(turn))
        # a method of several steps must not look back across the turn
        solver = make(rate, turn, np.array(dense(turn)), end, **{**options, "first_step": step})
    loads = {
        name: np.array([getattr(each, name) for each in states[1:]])
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
    """Return the class of a solver that has these options."""
    from scipy import integrate

    if isinstance(method, type) and issubclass(method, integrate.OdeSolver):
        make: type[Any] = method
    elif method in METHODS:
        make = getattr(integrate, str(method))
    else:
        raise InputError(f"method is {method!r}; expected one of {', '.join(METHODS)}, or a class of scipy's OdeSolver")
    # scipy itself warns of a name that is no option, and goes on without it
    known = [name for name in inspect.signature(make).parameters if name not in NO_OPTIONS]
    for name in options:
        if name not in known:
            raise InputError(f"{name!r} is no option of {make.__name__}; {nearest(name, known)}")
    return make


def _check_targets(where: object) -> None:
    if not isinstance(where, Mapping):
        raise InputError(
            f"place returned {where!r}; expected targets of the contact, such as {{'tangential_displacement': y[0]}}"
        )
    unknown = sorted(set(where) - set(INPUTS))
    if unknown:
        raise InputError(f"place returned {', '.join(map(repr, unknown))}; expected {', '.join(INPUTS)}")


def _first_turn(dense: Callable[[float], Floats], start: float, end: float, place: Place) -> float | None:
    """Return when a channel of the contact first turns round within a step; None where none does."""
    from scipy.optimize import minimize_scalar

    # a turn just behind the beginning, or before the end, is seen by the way the contact goes there
    shares = np.concatenate(([0.0, EDGE], np.arange(1, PARTS) / PARTS, [1.0 - EDGE, 1.0]))
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
                options={"xatol": TURN_TOLERANCE * abs(end - start) / PARTS},
            )
            if abs(extreme.x - start) > AT_BEGINNING * abs(end - start):
                found.append(float(extreme.x))
                break
    return min(found, key=lambda time: abs(time - start), default=None)


INPUTS = ("normal_load", "normal_displacement", "tangential_load", "tangential_displacement")
OUTPUTS = (
    "normal_load",
    "tangential_load",
    "approach",
    "tangential_displacement",
    "tangential_stiffness",
    "normal_stiffness",
    "contact_count",
    "slip_share",
    "dissipated_energy",
)


def contact_system(
    ensemble: "Ensemble",
    state: "State | None" = None,
    *,
    dt: float,
    inputs: Sequence[str] = ("tangential_displacement",),
    outputs: Sequence[str] = ("tangential_load",),
    name: str = "contact",
    saturate: bool = False,
    instrument: Instrument = RIGID,
) -> "control.NonlinearIOSystem":
    """Return a contact as a discrete-time system of python-control, with direct feedthrough.

    What a contact remembers is no vector of numbers: the one state of the system is the number of the sample. Outputs
    are tried from the contact at the beginning of the sample. Each simulation begins at 0, with `state`.

    Parameters
    ----------
    ensemble, state, saturate, instrument
        As for `solve_ivp`.
    dt : float
        Sampling time [s], > 0.
    inputs, outputs : sequence of str
        What drives it, of `INPUTS`, at most one of each channel; the other channel is held as `state` has it. What is
        read, of `OUTPUTS`. Another name is an InputError.
    name : str
        Of the system; its signals are ``name.signal``.
    """
    try:
        import control
    except ImportError as error:
        raise InputError("the package control is not installed; expected: pip install control") from error
    for named, known, what in ((inputs, INPUTS, "inputs"), (outputs, OUTPUTS, "outputs")):
        if wrong := [each for each in named if each not in known] or not named:
            raise InputError(f"{what}: {wrong if named else 'none'}; expected some of {', '.join(known)}")
    for channel in ("normal", "tangential"):
        if sum(each.startswith(channel) for each in inputs) > 1:
            raise InputError(f"inputs: both load and displacement of the {channel} channel; expected one of them")
    # by the number of the sample: the first one, the present, and the one before
    states = {0: state or ensemble.initial_state()}

    def moved(x: ArrayLike, u: ArrayLike) -> "tuple[int, State]":
        number = float(np.atleast_1d(x)[0])
        if number not in states:
            raise InputError(
                f"sample {number:g} of the contact: expected the present one of a simulation that begins at 0. It "
                "remembers its way and has no state to set or to linearise at; its tangential_stiffness is an output"
            )
        targets: dict[str, Any] = dict(zip(inputs, np.atleast_1d(u).astype(float).tolist(), strict=True))
        after = ensemble.advance(states[int(number)], **targets, saturate=saturate, instrument=instrument)
        return int(number), after

    def output(_time: float, x: ArrayLike, u: ArrayLike, _params: object) -> Floats:
        _, after = moved(x, u)
        return np.array([float(getattr(after, each)) for each in outputs])

    def update(_time: float, x: ArrayLike, u: ArrayLike, _params: object) -> Floats:
        number, after = moved(x, u)
        for old in set(states) - {0, number}:
            del states[old]
        states[number + 1] = after
        return np.array([float(number + 1)])

    signals = {"inputs": list(inputs), "outputs": list(outputs), "states": ["sample"]}
    return control.nlsys(update, output, **signals, dt=scalar("dt", dt, above=0), name=name)


@attrs.frozen(eq=False)
class StageMotion:
    """How a stage has moved."""

    time: Floats  #: (sample) When the controller was asked [s]
    place: Floats  #: (sample) Of the stage at the end of the sample [m]
    contact_force: Floats  #: (sample) Tangential load of the contact at the end of the sample [N]
    motor_force: Floats  #: (sample) During the sample [N]
    work: float  #: of the motor [J]
    kinetic: float  #: energy of the motion at the end [J]
    stored: float  #: energy in the tractions at the end [J]
    dissipated: float  #: energy lost to friction [J]
    state: "State"  #: the contact at the end


def controlled_stage(  # noqa: PLR0913 - a stage, its controller, and its contact
    ensemble: "Ensemble",
    state: "State",
    controller: Callable[[float, float], float],
    *,
    mass: float,
    sample_time: float,
    duration: float,
    substeps: int = 10,
    saturate: bool = False,
    instrument: Instrument = RIGID,
) -> StageMotion:
    """Move a stage on a contact by a motor, with a force that a controller sets at each sample.

    The stage begins at rest where `state` is, which is place 0. Between samples it is integrated by the leap-frog
    method, which tries no place that the stage does not reach.

    Parameters
    ----------
    ensemble, saturate, instrument
        As for `solve_ivp`.
    state : State
        The contact at the beginning, pressed. Its normal channel is held as it is: a load, or an approach.
    controller : callable
        ``controller(time, place)`` returns the force of the motor [N] until the next sample; called once a sample.
    mass, sample_time, duration : float
        [kg], [s], > 0.
    substeps : int
        Steps of the integration per sample, each much shorter than √(mass / stiffness).
    """
    mass, sample_time = scalar("mass", mass, above=0), scalar("sample_time", sample_time, above=0)
    samples = round(scalar("duration", duration, above=0) / sample_time)
    pause = _step_of_stage(state.stiffness(1), mass, sample_time, substeps)
    stepper = ensemble.stepper(state, saturate=saturate, instrument=instrument)
    origin = stepper.tangential_displacement
    before = stepper.dissipated_energy
    place = velocity = work = motor = 0.0
    record = np.empty((3, samples))
    for sample in range(samples):
        motor = scalar("the force of the controller", controller(sample * sample_time, place))
        for _ in range(substeps):
            velocity += pause / mass * (motor - stepper.tangential_load)
            step = pause * velocity
            place += step
            work += motor * step
            stepper.step(tangential_displacement=origin + place)
        record[:, sample] = place, stepper.tangential_load, motor
    end = stepper.save()
    # the velocity is that of half a step before
    velocity += 0.5 * pause / mass * (motor - end.tangential_load)
    return StageMotion(
        time=np.arange(samples, dtype=np.float64) * sample_time,
        place=record[0],
        contact_force=record[1],
        motor_force=record[2],
        work=work,
        kinetic=0.5 * mass * velocity**2,
        stored=end.stored_energy,
        dissipated=end.dissipated_energy - before,
        state=end,
    )


def _step_of_stage(stiffness: float, mass: float, sample_time: float, substeps: int) -> float:
    """Return the step of the integration [s]; one that is not stable is an InputError."""
    if isinstance(substeps, bool) or not isinstance(substeps, int) or substeps < 1:
        raise InputError(f"substeps is {substeps!r}; expected a whole number of 1 or more")
    pause = sample_time / substeps
    longest = 2.0 * (mass / stiffness) ** 0.5 if stiffness > 0.0 else np.inf
    if pause >= longest:
        raise InputError(
            f"substeps is {substeps}: steps of {pause:.3g} s are unstable, as the mass on the contact swings faster; "
            f"expected {int(sample_time / longest) + 1} or more, and ten times that to follow it well"
        )
    return pause
