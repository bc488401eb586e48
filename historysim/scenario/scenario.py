"""A scenario: materials, surface, friction, loading and recording options from one TOML file."""

import functools
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import attrs

from historysim.asperities.asperity_set import require_asperities
from historysim.asperities.body import Body, Feature
from historysim.asperities.ensemble import Ensemble
from historysim.basics.limits import at_most, most
from historysim.basics.system import log_message
from historysim.basics.wording import Notify, brief, html_table, shell_word, silent
from historysim.contact import hertz
from historysim.errors import InputError, LoadError, error_path, field_error
from historysim.loads.event_sequence import as_events, channel_values, to_loads
from historysim.loads.events import Event, NormalDisplacement, NormalLoad
from historysim.recording.recorder import UNKNOWN, chosen_asperities, largest_approach
from historysim.replaying import Replay
from historysim.scenario.document import (
    find_named_files,
    parse_toml,
    read_sections,
)
from historysim.scenario.loading_kinds import EACH
from historysim.scenario.schema import NumbersFile, from_table, located_errors
from historysim.scenario.sections import Coefficients, Sections
from historysim.scenario.surface_kinds import BuiltSurface

if TYPE_CHECKING:
    from historysim.asperities.adhering import AdheringAsperities
    from historysim.asperities.instrument import Instrument
    from historysim.contact.materials import MaterialPair
    from historysim.measured.reduction import Measurement
    from historysim.scenario.loading_kinds.measured_loading import MeasuredLoading


class BuiltScenario(NamedTuple):
    """Surface and replay of a scenario, checked and built once."""

    surface: BuiltSurface  #: with the quantities that depend on the largest load
    replay: Replay


@attrs.frozen
class Scenario:
    """A scenario and its file."""

    path: Path  #: the file
    text: str = attrs.field(repr=False)  #: content of the file (TOML), with replaced values
    sections: Sections  #: its structured content

    def _repr_html_(self) -> str:
        from html import escape

        lines = [
            ("title", " ".join(self.title.split())),
            ("file", str(self.path)),
            ("substeps", f"{self.sections.loading.substeps:,}"),
            ("recorded asperities", self.sections.record.text),
        ]
        return f"{html_table(lines)}<details><summary>TOML</summary><pre>{escape(self.text)}</pre></details>"

    @property
    def title(self) -> str:
        """Title; empty if it has none."""
        return self.sections.title

    @property
    def instrument(self) -> "Instrument":
        """Instrument in series with the contact; rigid by default."""
        return self.sections.instrument

    @property
    def metadata(self) -> dict[str, str]:
        """Attributes of written files: author, purpose and licence (ACDD); named states."""
        from historysim.recording.provenance import named_states_attribute

        providers = (
            section.registry.provider(type(section))
            for section in _within(self.sections)
            if hasattr(section, "registry")
        )
        packages = ", ".join(
            dict.fromkeys(str(provider) for provider in providers if provider is not None)
        )
        foreign = {"packages": packages} if packages else {}
        return (
            self.sections.metadata.values
            | named_states_attribute(self.sections.loading.names)
            | foreign
        )

    @property
    def seeds(self) -> list[int]:
        """Seeds of the surface, in the order of the file, and of friction."""
        sections = [
            section
            for section in (self.sections.surface, self.sections.friction)
            if section is not None
        ]
        seeds = [getattr(within, "seed", None) for item in sections for within in _within(item)]
        return [seed for seed in seeds if seed is not None]

    @property
    def document(self) -> dict[str, Any]:
        """Its tables; do not modify."""
        return _document(self.text)

    def at(self, point: Mapping[str, Any]) -> "Scenario":
        """Return the scenario at a point of a sweep, with its text unchanged; errors as for `load`."""
        from historysim.scenario.grid import with_values

        with located_errors(self.path.name):
            return attrs.evolve(
                self, sections=from_table(Sections, with_values(self.document, point))
            )

    def surface(self) -> BuiltSurface:
        """Build the surface and its summits, without the quantities that depend on the load.

        Raises InputError: a surface that cannot be used; the message names file and field.
        """
        with located_errors(self.path.name), error_path("surface"):
            built = self.sections.surface.build(self.path.parent)
            if built.passes is not None:
                coefficient = getattr(self.sections.friction, "coefficient", None)
                built = built.passes.apply(built, self.sections.materials.pair(), coefficient)
            return built

    def raw_surface(self) -> BuiltSurface | None:
        """Build the surface without preparation of its map (filters, form removal); None if nothing prepares it."""
        plain = self.sections.surface.without_preparation()
        with located_errors(self.path.name), error_path("surface"):
            return plain.build(self.path.parent) if plain else None

    def build(self, notify: Notify = silent, surface: BuiltSurface | None = None) -> BuiltScenario:
        """Check the scenario and build its surface and its replay: ensemble, events and options.

        ``notify`` receives notices on the reading of files and, unless ``surface`` is given, on the
        surface.

        Raises InputError: wrong input, or an event that does not fit the number of asperities.
        """
        if surface is None:
            surface = self.surface()
            for notice in surface.notices:
                notify(f"{self.path.name}: {notice}")
        events = as_events(self.events(notify))
        log_message(
            __name__,
            "info",
            "%s: the surface is made, %d events are read",
            self.path.name,
            len(events),
        )
        if surface.solutions is None and (surface.interacts or surface.ball_radius):
            surface = _surface_at_largest_load(self, surface, events, notify)
        with located_errors(self.path.name):
            ensemble = _build_ensemble(self.sections, surface)
            self._check_events(ensemble, events)
        loading = self.sections.loading
        replay = Replay(
            ensemble,
            events,
            substeps=loading.substeps,
            saturate=loading.saturate,
            record=self.sections.record.asperities,
            instrument=self.sections.instrument,
            hold=False,
            past=loading.past,
        )
        return BuiltScenario(surface, replay)

    def _check_events(self, ensemble: Body, events: Sequence[Event]) -> None:
        """Check that the events and the recorded indices fit the number of asperities."""
        record = self.sections.record.asperities
        if not isinstance(record, str):
            with error_path("record", "asperities"):
                chosen_asperities(ensemble, (), record)
        if self.sections.loading.past == UNKNOWN:
            from historysim.recording.unknown_past import check_bracketed

            with error_path("loading", "past"):
                check_bracketed(ensemble, events, self.sections.instrument)
        for event in events if to_loads(events) is None else ():
            if problem := event.problem(len(ensemble)):
                raise field_error(f"{event.name} at t = {event.time:g} s: {problem}", "loading")

    def ensemble(self) -> Body:
        """Build the ensemble.

        Raises InputError: materials, summits or friction that cannot be used; the message names
        file and field.
        """
        surface = self.surface()
        # events may come from a large file, and few surfaces need them
        if surface.interacts or surface.ball_radius:
            return self.build(surface=surface).replay.ensemble
        with located_errors(self.path.name):
            return _build_ensemble(self.sections, surface)

    def pair(self) -> "MaterialPair":
        """Build the material pair, with the work of adhesion of ``[adhesion]``; errors as for `ensemble`."""
        with located_errors(self.path.name):
            return self.sections.pair()

    def adhering(self, job: Replay) -> "AdheringAsperities | None":
        """Return the adhesion state of the asperities at the largest load of its replay.

        None without ``[adhesion]`` or without contact; InputError if ``[adhesion]`` cannot be used.
        """
        if (adhesion := self.sections.adhesion) is None:
            return None
        from historysim.asperities.adhering import adhering_asperities

        with located_errors(self.path.name), error_path("adhesion"):
            work = adhesion.work(job.ensemble.pair)
            approach = largest_approach(job.ensemble, job.events)
            if approach == 0:
                return None
            return adhering_asperities(
                require_asperities(job.ensemble),
                approach,
                work_of_adhesion=work,
                equilibrium_separation=adhesion.equilibrium_separation,
            )

    def replay(self) -> Replay:
        """Build the replay of the scenario; errors as for `build`."""
        return self.build().replay

    def events(self, notify: Notify = silent) -> Sequence[Event]:
        """Build the events, in time order; ``notify`` receives notices on the reading of files.

        Raises InputError: loads that cannot be used; the message names file and field, or line and
        column.
        """
        with located_errors(self.path.name):
            events = self.sections.loading.events(self.path.parent, notify)
            if not events:
                raise field_error("no waypoints; expected one or more", "loading")
            if (course := self.sections.course) is not None:
                with error_path("friction", "course"):
                    is_in_file = isinstance(course, NumbersFile)
                    written = course.course(self.path.parent) if is_in_file else course
                    events = written.along(events)
            steps = len(events) * self.sections.loading.substeps
            if steps > most("STEPS"):
                problem = f"{steps:,} steps; {at_most('STEPS')}; use fewer substeps"
                raise field_error(problem, "loading", "substeps")
        return events

    @contextmanager
    def locate_errors(self) -> Iterator[None]:
        """Add the waypoint, or the line of the file, to the error of an event."""
        try:
            yield
        except (LoadError, InputError) as error:
            if error.event is None:
                raise
            location = "loading"
            # the file may have changed since the start of the run
            with suppress(InputError, OSError, IndexError):
                location = self._place(error.event)
            raise type(error)(f"{self.path.name}: {location}: {error}") from error

    def _place(self, index: int) -> str:
        if self.sections.course is not None:
            # all changes of friction come from the course
            events = self.events()
            if events[index].changes_friction:
                return "friction.course"
            index -= sum(event.changes_friction for event in events[:index])
        return self.sections.loading.place(self.path.parent, index)

    @property
    def files(self) -> tuple[Path, ...]:
        """Its own file, and all files named in it."""
        return self.path, *find_named_files(self.sections, self.path.parent)

    @property
    def measured_files(self) -> tuple[Path, ...]:
        """Files of the replayed record; InputError if the loading is not measured."""
        loading = self.measured_loading()
        with located_errors(self.path.name), error_path("loading"):
            return tuple(loading.paths(self.path.parent))

    def picture_data(self, kind: str) -> object:
        """Return the data of a picture of the scenario, by the name of the picture."""
        from historysim.scenario.picture_section import picture_data

        return picture_data(self, kind)

    def measurement(self) -> "Measurement":
        """Read the record that the scenario replays.

        Raises InputError: a loading that is not measured, or a file that cannot be used.
        """
        loading = self.measured_loading()
        with located_errors(self.path.name):
            return loading.measurement(self.path.parent)

    @property
    def run(self) -> int | str | None:
        """Number of the run that is read, or ``"each"``; None for a single record."""
        chosen_run = getattr(self.sections.loading, "chosen_run", None)
        run: int | str | None = chosen_run(self.path.parent) if chosen_run else None
        return run

    def runs(self) -> "list[Scenario]":
        """Return a scenario for each run of its files, which are read once; only itself unless `run` is ``"each"``.

        Raises InputError: as for `measurement`.
        """
        return [*self.numbered_runs().values()] if self.run == EACH else [self]

    def numbered_runs(self) -> "dict[int, Scenario]":
        """Return a scenario for each run of its files, by number of the run; errors as for `measurement`."""
        from historysim.scenario.loading_kinds.run_loading import RunLoading

        with located_errors(self.path.name):
            loadings = RunLoading.read_all(self.path.parent, self.measured_loading())
        return {
            number: attrs.evolve(self, sections=attrs.evolve(self.sections, loading=loading))
            for number, loading in loadings.items()
        }

    def with_run_in_text(self) -> "Scenario":
        """Return the scenario of a run with the number of the run in its text."""
        from historysim.scenario.grid import text_with_values

        return attrs.evolve(self, text=text_with_values(self.text, {"loading.run": self.run}))

    def check_comparable(self) -> None:
        """Check that a record can be compared; InputError for a course of friction or blocks before the record."""
        with located_errors(self.path.name):
            if (
                getattr(self.sections.loading, "kind", "") == "file"
                and self.measured_loading().blocks
            ):
                problem = (
                    "only run replays blocks before a record: compare, fit and creep start with the record itself, "
                    "unloaded; expected none: remove them here, and skip the loops that depend on them (skip = 1)"
                )
                raise field_error(problem, "loading", "blocks")
            if self.sections.course is not None:
                problem = "comparison and fit use one constant coefficient; expected no course, or run the scenario"
                raise field_error(problem, "friction", "course")

    def measured_loading(self) -> "MeasuredLoading":
        """Return the measured loading; InputError if the loading is not measured."""
        loading: Any = self.sections.loading
        with located_errors(self.path.name):
            if loading.kind != "file":
                problem = "has no measured record; expected loading.file, or a scenario to run"
                raise field_error(f"{problem}: historysim run {shell_word(self.path)}", "loading")
        measured: MeasuredLoading = loading
        return measured


_document = functools.lru_cache(maxsize=1)(parse_toml)


def load(path: str | os.PathLike[str], values: Mapping[str, Any] | None = None) -> Scenario:
    """Read a scenario file.

    Parameters
    ----------
    path : path-like
        A TOML file.
    values : dict, optional
        Values that replace those in the file, by key, as ``{"friction.coefficient": 0.3}`` or
        ``{"loading.waypoints[1].tangential_load": "5 mN"}``; a key that is not in the file is
        added.

    Returns
    -------
    Scenario
        The scenario; its ``ensemble()`` and ``events()`` build the arguments of ``replay``.

    Raises
    ------
    InputError
        Not a path, a file that cannot be read or is not TOML, or wrong fields: one line for each,
        with its path.

    Examples
    --------
    >>> scenario = hs.load("scenarios/04_normal_up_tangential_up.toml", {"friction.coefficient": 0.3})
    >>> len(scenario.events())
    242
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"{brief(path)} is not a scenario; expected the path of a TOML file")
    path = Path(path)
    with located_errors(path.name or str(path)):
        return Scenario(path, *read_sections(path, values))


def as_scenario(scenario: Scenario | str | os.PathLike[str]) -> Scenario:
    """Return a scenario, read from its file if a path is given; errors as for `load`."""
    return scenario if isinstance(scenario, Scenario) else load(scenario)


def _within(section: Any) -> Iterator[Any]:  # noqa: ANN401 - sections of any kind
    """Yield a section and all sections nested in it."""
    yield section
    for value in attrs.asdict(section, recurse=False).values():
        for item in value.values() if isinstance(value, dict) else (value,):
            if attrs.has(type(item)):
                yield from _within(item)


def _surface_at_largest_load(
    scenario: Scenario, surface: BuiltSurface, events: Sequence[Event], notify: Notify
) -> BuiltSurface:
    """Add the quantities of a surface that depend on the largest load.

    These are the normal contact of a map with interaction, and the nominal area of a map on a ball:
    the Hertzian contact area of the smooth ball at that load.
    """
    load = (
        float(channel_values(events, NormalLoad).max(initial=0.0))
        / scenario.sections.pair().contact_modulus
    )
    approach = float(channel_values(events, NormalDisplacement).max(initial=0.0))
    if surface.ball_radius:
        pressed = float(
            hertz.approach(load, summit_radius=surface.ball_radius, contact_modulus=1.0)
        )
        area = math.pi * surface.ball_radius * max(pressed, approach)
        if surface.summits is not None and area > 0:
            surface = attrs.evolve(surface, summits=surface.summits.with_area(area))
    if not surface.interacts or surface.surface is None:
        return surface
    from historysim.interaction.solutions import NormalSolutions

    with located_errors(scenario.path.name), error_path("surface", "interaction"):
        solutions = NormalSolutions.solve(
            surface.surface,
            largest_load=load,
            largest_approach=approach,
            progress=True,
            notify=notify,
        )
    for notice in solutions.notices:
        notify(f"{scenario.path.name}: {notice}")
    return attrs.evolve(surface, solutions=solutions)


def _build_ensemble(sections: Sections, surface: BuiltSurface) -> Body:
    """Build the ensemble on a surface; errors as for `Scenario.ensemble`."""
    pair, friction = sections.pair(), sections.friction
    if (friction is None) == (surface.friction is None):
        both = "given both here and in surface.columns; expected one of them"
        none = "missing; expected [friction] with a coefficient, or surface.columns.friction"
        raise field_error(none if friction is None else both, "friction")
    of_scenario: Any = friction.coefficient if isinstance(friction, Coefficients) else friction
    coefficients = surface.friction if friction is None else of_scenario
    kind: Any = _body_type(surface)
    _check_supported(kind, sections, surface)
    with error_path("surface"):
        body: Body
        if surface.curve is not None:
            body = kind.from_normal_curves(pair, *surface.curve, coefficients, rings=sections.rings)
        elif surface.cylinder is not None:
            radius, length, depth = surface.cylinder
            body = kind(pair, radius, length, coefficients, depth)
        elif surface.solutions is not None:
            body = Ensemble.from_solutions(
                pair, surface.solutions, coefficients, rings=sections.rings
            )
        elif kind is not Ensemble:
            body = kind.from_summits(pair, surface.summits, coefficients)
        else:
            body = Ensemble.from_summits(
                pair,
                surface.summits,
                coefficients,
                wear=sections.wear,
                follow_sliding=sections.record.sliding,
                rings=sections.rings,
                yielding=surface.yielding,
                attraction=sections.attraction,
            )
        return body


def _body_type(surface: BuiltSurface) -> type[Body]:
    """Return the type of body on a surface: independent summits, summits on slopes, patches, or a cylinder."""
    if surface.cylinder is not None:
        from historysim.asperities.line_contact import LineContact

        return LineContact
    if surface.curve is not None or surface.solutions is not None:
        from historysim.asperities.patches import Patches

        return Patches
    if surface.summits is not None and surface.summits.slope is not None:
        from historysim.asperities.inclined import InclinedEnsemble

        return InclinedEnsemble
    return Ensemble


def _check_supported(kind: type[Body], sections: Sections, surface: BuiltSurface) -> None:
    """Check that a type of body supports all features that the keys of a scenario request."""
    requested: dict[Feature, tuple[bool, tuple[str, ...]]] = {
        "wear": (sections.wear is not None, ("wear",)),
        "sliding": (sections.record.sliding, ("record", "sliding")),
        "friction law": (
            not isinstance(sections.friction, Coefficients | None),
            ("friction", "law"),
        ),
        "attraction": (sections.attraction is not None, ("attraction",)),
        "yielding": (surface.yielding is not None, ("surface", "yielding")),
    }
    for feature, (is_requested, place) in requested.items():
        if is_requested and feature in kind.unsupported:
            raise field_error(kind.unsupported[feature], *place)
