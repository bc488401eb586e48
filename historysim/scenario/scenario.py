"""A scenario: materials, surface, friction, loading and what to record, from one TOML file."""

import functools
import logging
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from historysim.basics.limits import at_most, most
from historysim.basics.units import quantity_text
from historysim.basics.wording import Notify, brief, counted, html_table, shell_word, silent
from historysim.errors import InputError, LoadError, at, field_error
from historysim.loads.events import Event
from historysim.loads.friction_course import FrictionCourse
from historysim.scenario.document import files_of, parsed, read_sections, sections_of
from historysim.scenario.grid import with_values
from historysim.scenario.schema import reported
from historysim.scenario.sections import Sections, SweepSection
from historysim.scenario.surface_kinds import BuiltSurface

if TYPE_CHECKING:
    from historysim.asperities.ensemble import Ensemble
    from historysim.asperities.instrument import Instrument
    from historysim.contact.materials import MaterialPair
    from historysim.measured.reduction import Measurement
    from historysim.replaying import Replay
    from historysim.scenario.built import BuiltScenario
    from historysim.scenario.loading_kinds.assembly import MeasuredLoading


logger = logging.getLogger(__name__)


@attrs.frozen
class Scenario:
    """A scenario and its file."""

    path: Path  #: the file
    text: str = attrs.field(repr=False)  #: what stands in the file (TOML), with the values that take the place of some
    sections: Sections  #: what that means

    def _repr_html_(self) -> str:
        lines = [
            ("title", " ".join(self.title.split())),
            ("file", str(self.path)),
            ("substeps", f"{self.sections.loading.substeps:,}"),
            ("recorded asperities", self.sections.record.text),
        ]
        return f"{html_table(lines)}<details><summary>TOML</summary><pre>{escape(self.text)}</pre></details>"

    @property
    def title(self) -> str:
        """The title, empty if it has none."""
        return self.sections.title

    @property
    def instrument(self) -> "Instrument":
        """The instrument in series with the contact, rigid where none is named."""
        return self.sections.instrument

    @property
    def metadata(self) -> dict[str, str]:
        """Attributes of what is written: who made the data, what for, under which licence (ACDD); named states."""
        from historysim.recording.provenance import named_states_attribute

        providers = (each.registry.provider(type(each)) for each in _within(self.sections) if hasattr(each, "registry"))
        packages = ", ".join(dict.fromkeys(str(provider) for provider in providers if provider is not None))
        foreign = {"packages": packages} if packages else {}
        return self.sections.metadata.attributes() | named_states_attribute(self.sections.loading.names) | foreign

    @property
    def seeds(self) -> list[int]:
        """The seeds of the surface, in the order of the file, and of friction."""
        drawn = [each for each in (self.sections.surface, self.sections.friction) if each is not None]
        seeds = [getattr(within, "seed", None) for section in drawn for within in _within(section)]
        return [seed for seed in seeds if seed is not None]

    @property
    def document(self) -> dict[str, Any]:
        """Its tables, to be read only."""
        return _document(self.text)

    def at(self, point: Mapping[str, Any]) -> "Scenario":
        """Return it with the values of a point of a sweep, and with its text as it was; errors as for `load`."""
        with reported(self.path.name):
            return attrs.evolve(self, sections=sections_of(with_values(self.document, point)))

    def surface(self) -> BuiltSurface:
        """Return the surface and its summits, as they come.

        Raises InputError: a surface that cannot be used; the message names file and field.
        """
        with reported(self.path.name), at("surface"):
            built = self.sections.surface.build(self.path.parent)
            if built.passes is not None:
                coefficient = getattr(self.sections.friction, "coefficient", None)
                built = built.passes.done(built, self.sections.materials.pair(), coefficient)
            return built

    def unprepared_surface(self) -> BuiltSurface | None:
        """Return the surface without filters and what else prepares a map; None where nothing does."""
        plain = self.sections.surface.unprepared()
        with reported(self.path.name), at("surface"):
            return plain.build(self.path.parent) if plain else None

    def build(self, notify: Notify = silent, surface: BuiltSurface | None = None) -> "BuiltScenario":
        """Check the scenario and build what it describes: surface, ensemble and events.

        ``notify`` takes notices on how a file was read, and on the surface, unless what `surface` gives is there.

        Raises InputError: what cannot be used, or an event that does not fit the number of asperities.
        """
        if surface is None:
            surface = self.surface()
            for notice in surface.notices:
                notify(f"{self.path.name}: {notice}")
        events = self.events(notify)
        logger.info("%s: the surface is made, %d events are read", self.path.name, len(events))
        from historysim.scenario.built import built

        return built(self.path.name, self.sections, surface, events, notify)

    def ensemble(self) -> "Ensemble":
        """Return the ensemble.

        Raises InputError: materials, summits or friction that cannot be used; the message names file and field.
        """
        surface = self.surface()
        # events may come from a large file, and few surfaces depend on them
        if surface.interacts or surface.ball_radius:
            return self.build(surface=surface).ensemble
        from historysim.scenario.built import ensemble_on

        return ensemble_on(self.path.name, self.sections, surface)

    def pair(self) -> "MaterialPair":
        """Return the pair of materials, with the work of adhesion of ``[adhesion]``; errors as for `ensemble`."""
        with reported(self.path.name):
            return self.sections.pair()

    def replay(self) -> "Replay":
        """Return the replay that the scenario describes; errors as for `build`."""
        return self.build().replay

    def events(self, notify: Notify = silent) -> Sequence[Event]:
        """Return the events, in time order; ``notify`` takes notices on how a file was read.

        Raises InputError: loads that cannot be used; the message names file and field, or line and column.
        """
        with reported(self.path.name):
            events = self.sections.loading.events(self.path.parent, notify)
            if not events:
                raise field_error("no waypoints; expected one or more", "loading")
            if (course := self.sections.course) is not None:
                with at("friction", "course"):
                    written = course if isinstance(course, FrictionCourse) else course.course(self.path.parent)
                    events = written.along(events)
            steps = len(events) * self.sections.loading.substeps
            if steps > most("STEPS"):
                problem = f"{steps:,} steps; {at_most('STEPS')}; use fewer substeps"
                raise field_error(problem, "loading", "substeps")
        return events

    @contextmanager
    def locate_errors(self) -> Iterator[None]:
        """Put the place of an event that cannot be carried out before its error: the waypoint, or the line."""
        try:
            yield
        except (LoadError, InputError) as error:
            if error.event is None:
                raise
            place = "loading"
            # a file that has changed since the run began
            with suppress(InputError, OSError, IndexError):
                place = self._place(error.event)
            raise type(error)(f"{self.path.name}: {place}: {error}") from error

    def _place(self, index: int) -> str:
        if self.sections.course is not None:
            # all changes of friction are of the course
            events = self.events()
            if events[index].changes_friction:
                return "friction.course"
            index -= sum(event.changes_friction for event in events[:index])
        return self.sections.loading.place(self.path.parent, index)

    @property
    def files(self) -> tuple[Path, ...]:
        """Its own file, and all that it names."""
        return self.path, *files_of(self.sections, self.path.parent)

    @property
    def measured_files(self) -> tuple[Path, ...]:
        """The files that the scenario replays; a loading that is not measured is an InputError."""
        return tuple(self.path.parent / file for file in self.measured_loading().files)

    def picture_data(self, kind: str) -> object:
        """Return what a picture of the scenario is drawn of, by the name of the picture."""
        from historysim.scenario.picture_section import picture_data

        return picture_data(self, kind)

    def measurement(self) -> "Measurement":
        """Return what was measured, from the file that the scenario replays.

        Raises InputError: a loading that is not measured, or a file that cannot be used.
        """
        loading = self.measured_loading()
        with reported(self.path.name):
            return loading.measurement(self.path.parent)

    @property
    def run(self) -> int | str | None:
        """Which run of its file is read, or ``"each"``; None where that is open."""
        run: int | str | None = getattr(self.sections.loading, "run", None)
        return run

    def runs(self) -> "list[Scenario]":
        """Return a scenario for each run of its file; itself alone, unless ``loading.run`` is ``"each"``.

        Raises InputError: as for `measurement`.
        """
        from historysim.scenario.loading_kinds.assembly import EACH, runs_of

        loading = self.measured_loading()
        if loading.run != EACH:
            return [self]
        with reported(self.path.name), at("loading"):
            loadings = [attrs.evolve(loading, run=number) for number in runs_of(self.path.parent, loading)]
        return [attrs.evolve(self, sections=attrs.evolve(self.sections, loading=each)) for each in loadings]

    def check_comparable(self) -> None:
        """Check that a record can be compared: a course of friction, or blocks before the record, are an InputError."""
        with reported(self.path.name):
            if getattr(self.sections.loading, "kind", "") == "file" and self.measured_loading().blocks:
                problem = (
                    "only run replays blocks before a record: compare, fit and creep begin with the record itself, at "
                    "rest; expected none: remove them here, and leave out the loops that remember them (skip = 1)"
                )
                raise field_error(problem, "loading", "blocks")
            if self.sections.course is not None:
                problem = "a record is compared with, and fitted by, one coefficient; expected none, or run it"
                raise field_error(problem, "friction", "course")

    def measured_loading(self) -> "MeasuredLoading":
        """Return the loading that is measured; another is an InputError."""
        loading: Any = self.sections.loading
        with reported(self.path.name):
            if loading.kind != "file":
                problem = "has no measured record; expected loading.file, or a scenario to run"
                raise field_error(f"{problem}: historysim run {shell_word(self.path)}", "loading")
        measured: MeasuredLoading = loading
        return measured


_document = functools.lru_cache(maxsize=1)(parsed)


def load(path: str | os.PathLike[str], values: Mapping[str, Any] | None = None) -> Scenario:
    """Return the scenario of a file.

    Parameters
    ----------
    path : path-like
        A TOML file.
    values : dict, optional
        Values that take the place of those in the file, by key, as ``{"friction.coefficient": 0.3}`` or
        ``{"loading.waypoints[1].tangential_load": "5 mN"}``; a key that is not in the file is added.

    Returns
    -------
    Scenario
        The scenario; its ``ensemble()`` and ``events()`` build what ``replay`` takes.

    Raises
    ------
    InputError
        No path, a file that cannot be read or is not TOML, or fields that cannot be used: one line for each, with
        the path to it.

    Examples
    --------
    >>> scenario = hs.load("scenarios/04_normal_up_tangential_up.toml", {"friction.coefficient": 0.3})
    >>> len(scenario.events())
    242
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"{brief(path)} is no scenario; expected the path of a TOML file")
    path = Path(path)
    with reported(path.name or str(path)):
        return Scenario(path, *read_sections(path, values))


def scenario_of(document: Mapping[str, Any], name: str) -> Scenario:
    """Return the scenario of tables, as if a file of that name in this folder held them; errors as for `load`."""
    import tomlkit

    with reported(name):
        return Scenario(Path(name), tomlkit.dumps(document), sections_of(document))


def as_scenario(scenario: Scenario | str | os.PathLike[str]) -> Scenario:
    """Return a scenario, read from its file where that is given; errors as for `load`."""
    return scenario if isinstance(scenario, Scenario) else load(scenario)


def _within(section: Any) -> Iterator[Any]:  # noqa: ANN401 - sections of any kind
    """Yield a section, and those within it."""
    yield section
    for value in attrs.asdict(section, recurse=False).values():
        for each in value.values() if isinstance(value, dict) else (value,):
            if attrs.has(type(each)):
                yield from _within(each)


def summary(scenario: Scenario, *, walk: float = 0.0) -> list[tuple[str, str]]:
    """Check a scenario and return it in lines of (label, text), with a warning for each broken assumption of the model.

    Its loads are walked for ``walk`` seconds; a line says how far, where that is not enough.

    Raises InputError and LoadError: what cannot be used, and loads that were walked and cannot be carried.
    """
    from historysim.loads.event_sequence import over_text, time_text
    from historysim.recording.provenance import validity_findings

    surface = scenario.surface()
    notices = list(surface.notices)
    built = scenario.build(notices.append, surface)
    ensemble, events, contact = built.ensemble, built.events, built.adhering()
    with scenario.locate_errors():
        reached = built.walk(walk) if walk else None
    if reached is not None:
        notices.append(
            f"the loads were walked up to t = {time_text(reached)} within {walk:g} s, and not beyond; the environment "
            "variable HISTORYSIM_MOST_SECONDS_OF_VALIDATION gives more time"
        )
    laws = {"friction": ensemble.law, "wear": ensemble.wear, "yielding": ensemble.yielding}
    before, sweep = scenario.unprepared_surface(), scenario.sections.sweep
    return [
        ("title", " ".join(scenario.title.split()) or scenario.path.stem),
        ("asperities", f"{len(ensemble):,}"),
        ("events", f"{len(events):,}{over_text(events)}"),
        ("substeps", str(scenario.sections.loading.substeps)),
        ("recorded asperities", scenario.sections.record.text),
        *((name, law.text) for name, law in laws.items() if law),
        *([("sweep", _sweep_line(sweep))] if sweep else []),
        *([("map as it comes", _map_line(before)), ("map as prepared", _map_line(built.surface))] if before else []),
        *(contact.summary() if contact else []),
        *(("note", notice) for notice in notices),
        *(("warning", finding.text) for finding in validity_findings(ensemble, events, scenario.instrument)),
    ]


def _sweep_line(sweep: SweepSection) -> str:
    grid = sweep.grid()
    axes = " × ".join(f"{len(axis.values)} of {' with '.join(axis.keys)}" for axis in grid.axes)
    return f"{counted(len(grid), 'cell', 'cells')}: {axes}"


def _map_line(built: BuiltSurface) -> str:
    """Return the statistics of a map and its summits in a line."""
    import numpy as np

    surface, summits = built.surface, built.summits
    if surface is None or summits is None:
        return "none"
    statistics = surface.statistics()
    heights = f"Rq {quantity_text(statistics.rms_height, 'm')}, Rz {quantity_text(statistics.height_range, 'm')}"
    points = " × ".join(map(str, surface.shape))
    radius = quantity_text(float(np.median(summits.radius)), "m")
    slope = f"rms slope {statistics.rms_slope:.3g}"
    return f"{points} points, {heights}, {slope}, {len(summits):,} summits, median radius {radius}"
