"""`Ensemble`: asperities that share one approach and one tangential displacement, and how their state moves."""

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.curves import NormalCurves, Superposition
from historysim.asperities.instrument import RIGID, Instrument
from historysim.asperities.parameters import Parameters
from historysim.basics.arguments import scalar
from historysim.basics.units import range_text
from historysim.basics.wording import counted
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.memory.paths import DISPLACED, STILL, Goals, Paths, paths_to
from historysim.memory.rows import Rows, blank_rows

if TYPE_CHECKING:
    from historysim.asperities.asperity import Asperity
    from historysim.asperities.evolution import Evolution
    from historysim.asperities.friction import FrictionGoal
    from historysim.asperities.moving import Moving
    from historysim.asperities.projectors import Projectors
    from historysim.asperities.state import EnsembleState
    from historysim.asperities.stepper import Stepper, Totals
    from historysim.interaction.solutions import NormalSolutions


@attrs.frozen(eq=False, init=False, repr=False)
class Ensemble(Parameters):
    """Hertzian asperities under one rigid flat: shared approach, shared tangential displacement, no other interaction.

    Parameters
    ----------
    pair : MaterialPair
    summit_height : array_like
        Heights z of the summits over any datum [m], scalar or one per asperity.
    summit_radius : array_like
        Radii R [m], > 0, one for all or one per asperity.
    friction : array_like or FrictionLaw
        Coulomb coefficients μ ≥ 0, one for all or one per asperity, or a law (see `historysim.asperities.laws`).
    x, y : array_like, optional
        Positions of the summits [m]; carried along, without influence.
    nominal_area : float, optional
        Area that the asperities stand on [m²], > 0; carried along, without influence.
    tolerance : float
        Relative change of displacement and energy at which a ramp of both loads that has to be
        refined is taken as settled (see `ramp`).
    curves : NormalCurves, optional
        Of patches, whose elements the summits then are; `from_normal_curves` makes both. Asperities are
        then the patches.
    wear : WearLaw, optional
        What sliding takes from the asperities (see `historysim.asperities.wear`).
    follow_sliding : bool
        Follow how far each asperity slides, which wear and friction that depends on it do in any case.

    Raises
    ------
    InputError
        A number that is not finite or out of range, arrays of different lengths, or patches that shall evolve.
    """

    @classmethod
    def from_summits(cls, pair: MaterialPair, summits: Any, friction: "npt.ArrayLike", **options: Any) -> Self:
        """Make an ensemble of summits, which have ``height``, ``radius``, ``x`` and ``y`` [m]."""
        options = {"x": summits.x, "y": summits.y, "nominal_area": getattr(summits, "nominal_area", None)} | options
        return cls(pair, summits.height, summits.radius, friction, **options)

    @classmethod
    def from_normal_curves(
        cls,
        pair: MaterialPair,
        approach: "npt.ArrayLike",
        load: "npt.ArrayLike",
        area: "npt.ArrayLike | None" = None,
        friction: float = 0.2,
        **options: Any,
    ) -> Self:
        """Make an ensemble of patches of one contact, which may press on one another, of their normal curves.

        Tangential loads are superpositions of normal ones, whatever the shape of the contact and however its
        patches interact (Jäger 1998; Ciavarella 1998): exact for similar materials (Dundurs' β = 0), one direction
        of the tangential load, and ν = 0; for other ν a small transverse slip is neglected.

        Parameters
        ----------
        pair : MaterialPair
            Its E*/(4 G*) turns approaches into tangential displacements.
        approach : array_like (row)
            Of the whole contact, from first touch at 0, ascending [m].
        load : array_like (row) or (row, patch)
            Normal load of each patch at that approach [N]; one column alone is the whole contact, as an
            indentation measures it. Their sum rises ever faster; noise is smoothed (`NormalCurves.misfit`).
        area : array_like, of the shape of ``load``, optional
            Contact areas [m²]; without them there are no areas in the history.
        friction : float
            Coulomb coefficient μ ≥ 0 of the whole contact.
        **options
            ``x`` and ``y``, positions of the patches [m] (patch); ``highest_summit``, height of the flat at first
            touch [m]; ``tolerance``.

        Raises
        ------
        InputError
            A table that no elastic contact has: the message names the row.
        """
        if not isinstance(pair, MaterialPair):
            raise InputError(f"pair is {pair!r}; expected a MaterialPair")
        places = {name: options.pop(name) for name in ("x", "y") if name in options}
        top = scalar("highest_summit", options.pop("highest_summit", 0.0))
        curves = NormalCurves.from_table(approach, load, area, **places)
        radius = (0.75 * curves.weight / pair.contact_modulus) ** 2
        return cls(pair, top - curves.label, radius, scalar("friction", friction, least=0), curves=curves, **options)

    @classmethod
    def from_solutions(
        cls, pair: MaterialPair, solutions: "NormalSolutions", friction: float = 0.2, **options: Any
    ) -> Self:
        """Make an ensemble of the patches of a rough contact; see `from_normal_curves`, which raises its errors."""
        x, y = solutions.position
        load = solutions.load * pair.contact_modulus
        known = {"x": x, "y": y, "highest_summit": solutions.highest_summit}
        return cls.from_normal_curves(pair, solutions.approach, load, solutions.area, friction, **known, **options)

    def __repr__(self) -> str:
        least, most = self.friction.min(), self.friction.max()
        friction = f"friction {least:.4g}" + (f" to {most:.4g}" if most > least else "")
        if self.law is not None:
            friction = f"friction of {self.law.text}"
        if self.curves is not None:
            return f"<Ensemble: {counted(len(self), 'patch', 'patches')} with normal curves, {friction}>"
        summits = [("height", self.summit_height, "m"), ("radius", self.summit_radius, "m")]
        told = [f"summit {name} {range_text(each.min(), each.max(), unit)}" for name, each, unit in summits]
        return f"<Ensemble: {counted(len(self), 'asperity', 'asperities')}, {', '.join(told)}, {friction}>"

    @cached_property
    def _moving(self) -> "Moving":
        """What moves states; it takes the compiler, which parameters and their checks do without."""
        from historysim.asperities.moving import Moving

        # if it held the ensemble, that and its arrays would stay until the collector finds both
        return Moving(self.alone())

    @property
    def evolution(self) -> "Evolution":
        """What makes the asperities evolve."""
        return self._moving.evolution

    def initial_state(self) -> "EnsembleState":
        """Return the unloaded state: the highest summit just touches, nothing is remembered."""
        return self._moving.initial_state()

    def advance(
        self,
        state: "EnsembleState",
        *,
        normal_load: float | None = None,
        normal_displacement: float | None = None,
        tangential_load: float | None = None,
        tangential_displacement: float | None = None,
        friction: "npt.ArrayLike | None" = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> "EnsembleState":
        """Return the state after one joint straight path; ``state`` itself is not changed.

        With both loads given, the path is straight in (N, T); with a displacement, straight in the
        approach and U. A channel that is not named is held as it was controlled last: a load stays, or
        a displacement does.

        An instrument makes tangential displacements those of its drive, U + T/k_s: U is found so that
        they are reached, or held. It is a parameter of the path and no part of the state, so give it with
        each path that it drives.

        Parameters
        ----------
        state : "EnsembleState"
        normal_load, tangential_load : float, optional
            Total loads to reach [N]; N ≥ 0.
        normal_displacement : float, optional
            Approach of the highest summit from first touch to reach [m]; negative is a gap.
        tangential_displacement : float, optional
            U to reach [m], or with an instrument the displacement of its drive.
        friction : array_like, optional
            New coefficients that act at the end of the path (see `FrictionChange`).
        saturate : bool
            Hold a tangential load beyond the limit at the limit.
        instrument : Instrument, optional
            In series with the contact.

        Raises
        ------
        FrictionLimitError
            |T| > Σ μ N.
        InputError
            A value that is not finite, a negative normal load, both a load and a displacement of one channel, or
            what is no instrument.
        """
        return self._moving.advance(
            state,
            normal_load=normal_load,
            normal_displacement=normal_displacement,
            tangential_load=tangential_load,
            tangential_displacement=tangential_displacement,
            friction=friction,
            saturate=saturate,
            instrument=instrument,
        )

    def advance_many(
        self,
        state: "EnsembleState",
        *,
        normal_load: "npt.ArrayLike | None" = None,
        normal_displacement: "npt.ArrayLike | None" = None,
        tangential_load: "npt.ArrayLike | None" = None,
        tangential_displacement: "npt.ArrayLike | None" = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> "tuple[EnsembleState, Totals]":
        """Return the state after straight paths, one after the other, and the totals at the end of each.

        It is what as many calls of `advance` would do, bit for bit.

        Parameters
        ----------
        state : "EnsembleState"
        normal_load, normal_displacement, tangential_load, tangential_displacement : array_like (path), optional
            As for `advance`, one value for each path; one number stands for all of them.
        saturate : bool
            Hold tangential loads beyond the limit at the limit.
        instrument : Instrument, optional
            In series with the contact.

        Returns
        -------
        EnsembleState
        Totals

        Raises
        ------
        FrictionLimitError, CurveEndError
            With the position of the path that cannot be walked.
        InputError
            As for `advance`, or lists of different lengths.
        """
        return self._moving.advance_many(
            state,
            normal_load=normal_load,
            normal_displacement=normal_displacement,
            tangential_load=tangential_load,
            tangential_displacement=tangential_displacement,
            saturate=saturate,
            instrument=instrument,
        )

    def stepper(
        self, state: "EnsembleState | None" = None, *, saturate: bool = False, instrument: Instrument = RIGID
    ) -> "Stepper":
        """Return what steps a state in place, for tight loops; it starts unloaded by default.

        Raises
        ------
        InputError
            What is no instrument, or asperities that evolve.
        """
        return self._moving.stepper(state, saturate=saturate, instrument=instrument)

    def load_state(self, path: "str | Path") -> "EnsembleState":
        """Return a state of this ensemble from a file that `EnsembleState.save` has written.

        Raises
        ------
        InputError
            A file that is none of a state, one that a later version wrote, or one of other asperities.
        OSError
            The file cannot be read.
        """
        from historysim.asperities.saved_state import read

        return read(self.initial_state(), Path(path))

    def with_friction(
        self,
        state: "EnsembleState",
        friction: "npt.ArrayLike",
        *,
        asperities: "npt.ArrayLike | None" = None,
        instrument: Instrument = RIGID,
    ) -> "EnsembleState":
        """Return the state with other friction coefficients from now on.

        Where a coefficient falls, springs beyond the new limit slip at once. A controlled tangential
        load stays, and so does the displacement of an instrument's drive: U follows, as it would if the
        coefficients fell in many small steps. A load that friction no longer holds is still what the
        state tells and asks for: the contact slides at the displacement at which it began to, and the
        next path, if only one that holds the load, is refused, or holds it at the limit. What is given here takes
        the place of a law.

        Parameters
        ----------
        state : "EnsembleState"
        friction : array_like
            One coefficient, or one per asperity.
        asperities : array_like, optional
            Those that it is for, by index; all by default.
        instrument : Instrument, optional

        Raises
        ------
        InputError
            See `friction.coulomb`, indices that the ensemble does not have, or what is no instrument.
        """
        return self._moving.with_friction(state, friction, asperities=asperities, instrument=instrument)

    def with_geometry(
        self,
        state: "EnsembleState",
        *,
        summit_height: "npt.ArrayLike | None" = None,
        summit_radius: "npt.ArrayLike | None" = None,
        asperities: "npt.ArrayLike | None" = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> "EnsembleState":
        """Return the state with other summits from now on, each of which is a new contact.

        What the old contact of a changed summit remembered is erased, its springs are no longer strained; those that
        keep their height and radius remember. Then each channel goes back to where it was: a controlled load is
        restored, straight with the other one where both are.

        Parameters
        ----------
        state : "EnsembleState"
        summit_height, summit_radius : array_like, optional
            New ones [m], one or one each, the heights over the same datum; those that are not given stay.
        asperities : array_like, optional
            Those that they are for, by index; all by default.
        saturate, instrument
            As for `advance`.

        Raises
        ------
        InputError
            Numbers out of range, indices that the ensemble does not have, or an ensemble of patches.
        FrictionLimitError
            The new contact does not hold the tangential load.
        """
        return self._moving.with_geometry(
            state,
            summit_height=summit_height,
            summit_radius=summit_radius,
            asperities=asperities,
            saturate=saturate,
            instrument=instrument,
        )

    def walk(
        self,
        state: "EnsembleState",
        paths: Paths,
        *,
        rows: Rows | None = None,
        asperities: npt.ArrayLike = (),
        saturate: bool = False,
        instrument: Instrument = RIGID,
        until: float = 1.0,
        friction: "FrictionGoal | None" = None,
        projectors: "Projectors | None" = None,
    ) -> "EnsembleState":
        """Return the state after straight paths, one after the other, and record rows on the way.

        Parameters
        ----------
        state : "EnsembleState"
        paths : Paths
            With targets in N and m.
        rows : Rows, optional
            Where the rows that the paths record are written, in SI units (see `blank_rows`); none are
            recorded by default.
        asperities : array_like (column)
            Indices of the asperities to record, in the order of the columns of ``rows``.
        saturate : bool
            Hold tangential loads beyond the limit at the limit.
        instrument : Instrument, optional
            In series with the contact: tangential displacements are those of its drive.
        until : float
            Share of each path that is walked.
        friction : "FrictionGoal", optional
            Where friction goes on each path, straight with the channels.
        projectors : "Projectors", optional
            Threads that the asperities of many rows are recorded by, where they do not evolve.

        Raises
        ------
        FrictionLimitError, CurveEndError
            With the position of the path that cannot be walked.
        InputError
            What is no instrument, or patches whose friction shall go elsewhere.
        """
        return self._moving.walk(
            state,
            paths,
            rows=rows,
            asperities=asperities,
            saturate=saturate,
            instrument=instrument,
            until=until,
            friction=friction,
            projectors=projectors,
        )

    def approach_at(self, normal_load: float) -> float:
        """Return the approach of the highest summit [m] at which the asperities carry a total normal load [N].

        Raises
        ------
        InputError
            A load that is not a finite number of 0 or more.
        """
        return self._moving.approach_at(normal_load)

    def superposition(self, state: "EnsembleState") -> Superposition:
        """Return pressures and tractions of patches as sums of those in the table of their normal curves.

        Raises
        ------
        InputError
            The ensemble is one of summits.
        """
        if self.curves is None:
            raise InputError("the ensemble has no normal curves; expected one from normal curves: see asperity")
        rows, hold = blank_rows(1, self.elements), Goals(DISPLACED, *STILL)
        summits = type(self)(self.pair, self.summit_height, self.summit_radius, self.friction, tolerance=self.tolerance)
        summits.walk(state, paths_to(hold, hold), rows=rows, asperities=np.arange(self.elements))
        return self.curves.superposed(rows)

    def asperity(self, index: int, state: "EnsembleState") -> "Asperity":
        """Return one asperity, holding its memory in a state.

        Raises
        ------
        InputError
            An index that the ensemble does not have.
        """
        from historysim.asperities.asperity import Asperity
        from historysim.memory.traction import TractionMemory

        if self.curves is not None:
            raise InputError(
                "a patch of a normal curve is no asperity with a radius of its own; expected an ensemble of summits. "
                "A replay records the loads and areas of the patches"
            )
        if not 0 <= index < len(self):
            raise InputError(f"asperity {index} does not exist; expected an index from 0 to {len(self) - 1}")
        position = int(np.flatnonzero(state.order == index)[0])
        shape = state.evolved or self
        return Asperity(
            index=index,
            pair=self.pair,
            summit_height=float(shape.summit_height[index]),
            summit_radius=float(shape.summit_radius[index]),
            memory=TractionMemory.of(state.contact, state.memory, state.units, position),
        )
