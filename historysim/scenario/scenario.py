"""A scenario: materials, surface, friction, loading and recording options from one TOML file."""

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
from historysim.basics.wording import Notify, brief, count_text, html_table, shell_word, silent
from historysim.errors import InputError, LoadError, error_path, field_error
from historysim.loads.events import Event
from historysim.loads.friction_course import FrictionCourse
from historysim.scenario.document import (
    find_named_files,
    parse_toml,
    read_sections,
    structure_sections,
)
from historysim.scenario.grid import text_with_values, with_values
from historysim.scenario.loading_kinds import EACH
from historysim.scenario.schema import located_errors
from historysim.scenario.sections import Sections, SweepSection
from historysim.scenario.surface_kinds import BuiltSurface

if TYPE_CHECKING:
    from historysim.asperities.body import Body
    from historysim.asperities.instrument import Instrument
    from historysim.contact.materials import MaterialPair
    from historysim.measured.reduction import Measurement
    from historysim.replaying import Replay
    from historysim.scenario.build import BuiltScenario
    from historysim.scenario.loading_kinds.measured_loading import MeasuredLoading


logger = logging.getLogger(__name__)


@attrs.frozen
class Scenario:
    """A scenario and its file."""

    path: Path  #: the file
    text: str = attrs.field(repr=False)  #: content of the file (TOML), with replaced values
    sections: Sections  #: its structured content

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
        with located_errors(self.path.name):
            return attrs.evolve(
                self, sections=structure_sections(with_values(self.document, point))
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

    def build(
        self, notify: Notify = silent, surface: BuiltSurface | None = None
    ) -> "BuiltScenario":
        """Check the scenario and build its surface, ensemble and events.

        ``notify`` receives notices on the reading of files and, unless ``surface`` is given, on the
        surface.

        Raises InputError: wrong input, or an event that does not fit the number of asperities.
        """
        if surface is None:
            surface = self.surface()
            for notice in surface.notices:
                notify(f"{self.path.name}: {notice}")
        events = self.events(notify)
        logger.info("%s: the surface is made, %d events are read", self.path.name, len(events))
        from historysim.scenario.build import build_scenario

        return build_scenario(self.path.name, self.sections, surface, events, notify)

    def ensemble(self) -> "Body":
        """Build the ensemble.

        Raises InputError: materials, summits or friction that cannot be used; the message names
        file and field.
        """
        surface = self.surface()
        # events may come from a large file, and few surfaces need them
        if surface.interacts or surface.ball_radius:
            return self.build(surface=surface).ensemble
        from historysim.scenario.build import build_ensemble

        return build_ensemble(self.path.name, self.sections, surface)

    def pair(self) -> "MaterialPair":
        """Build the material pair, with the work of adhesion of ``[adhesion]``; errors as for `ensemble`."""
        with located_errors(self.path.name):
            return self.sections.pair()

    def replay(self) -> "Replay":
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
                    written = (
                        course
                        if isinstance(course, FrictionCourse)
                        else course.course(self.path.parent)
                    )
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
        from historysim.scenario.loading_kinds.measured_loading import RunLoading

        with located_errors(self.path.name):
            loadings = RunLoading.read_all(self.path.parent, self.measured_loading())
        return {
            number: attrs.evolve(self, sections=attrs.evolve(self.sections, loading=loading))
            for number, loading in loadings.items()
        }

    def with_run_in_text(self) -> "Scenario":
        """Return the scenario of a run with the number of the run in its text."""
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


def summary(scenario: Scenario, *, walk: float = 0.0) -> list[tuple[str, str]]:
    """Check a scenario and summarise it in lines of (label, text), with warnings for violated assumptions of the model.

    Its loads are replayed for ``walk`` seconds; a line states how far if that is not enough.

    Raises InputError and LoadError: wrong input, and loads that the contact cannot support.
    """
    from historysim.loads.event_sequence import over_text, time_text
    from historysim.recording.provenance import validity_findings
    from historysim.recording.unknown_past import past_lines

    surface = scenario.surface()
    notices = list(surface.notices)
    built = scenario.build(notices.append, surface)
    ensemble, events, contact = built.ensemble, built.events, built.adhering()
    with scenario.locate_errors():
        reached = built.walk(walk) if walk else None
    if reached is not None:
        notices.append(
            f"the loads were checked up to t = {time_text(reached)} within {walk:g} s; the environment "
            "variable HISTORYSIM_MOST_SECONDS_OF_VALIDATION allows more time"
        )
    raw_surface, sweep = scenario.raw_surface(), scenario.sections.sweep
    return [
        ("title", " ".join(scenario.title.split()) or scenario.path.stem),
        ("asperities", f"{len(ensemble):,}"),
        ("events", f"{len(events):,}{over_text(events)}"),
        ("substeps", str(scenario.sections.loading.substeps)),
        ("recorded asperities", scenario.sections.record.text),
        *past_lines(scenario.sections.loading.past),
        *((name, law.text) for name, law in ensemble.laws.items()),
        *([("sweep", _sweep_line(sweep))] if sweep else []),
        *(
            [
                ("map as it comes", _map_line(raw_surface)),
                ("map as prepared", _map_line(built.surface)),
            ]
            if raw_surface
            else []
        ),
        *(contact.summary() if contact else []),
        *(("note", notice) for notice in notices),
        *(
            ("warning", finding.text)
            for finding in validity_findings(ensemble, events, scenario.instrument)
        ),
    ]


def _sweep_line(sweep: SweepSection) -> str:
    grid = sweep.grid()
    axes = " × ".join(f"{len(axis.values)} of {' with '.join(axis.keys)}" for axis in grid.axes)
    return f"{count_text(len(grid), 'cell', 'cells')}: {axes}"


def _map_line(built: BuiltSurface) -> str:
    """Summarise a map and its summits in one line."""
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
