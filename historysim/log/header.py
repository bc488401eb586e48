"""The head of a log: all inputs of a replay except the events, so that no other file is needed."""

import functools
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, Self

import attrs
import numpy as np

from historysim._version import __version__
from historysim.asperities.body import Body, Feature, require
from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import Instrument, Rings
from historysim.asperities.law import (
    ATTRACTIONS,
    WEAR_LAWS,
    YIELDING_LAWS,
    law_from_settings,
)
from historysim.asperities.law import LAWS as FRICTION_LAWS
from historysim.basics.arguments import Array
from historysim.basics.limits import at_most, most
from historysim.basics.registry import Registry
from historysim.basics.units import convert_each
from historysim.basics.wording import format_value
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError, MissingPackageError
from historysim.loads.events import Event
from historysim.log.canonical import array_digest
from historysim.recording.provenance import made_with
from historysim.recording.recorder import PASTS, UNTOUCHED
from historysim.replaying import Replay

# Forms of a log: plain; with asperities that evolve, patches of normal curves, summits that yield,
# or slopes. A spring in parallel, a line contact, attraction and an unknown past, which earlier
# versions do not support, have separate formats.
PLAIN, OF_LAWS, OF_CURVES, OF_YIELDING, OF_SLOPES = 1, 3, 4, 5, 7
OF_PARALLEL, OF_LINES, OF_ATTRACTION, OF_PASTS = 8, 9, 10, 11
FORMATS = (
    PLAIN,
    OF_LAWS,
    OF_CURVES,
    OF_YIELDING,
    OF_SLOPES,
    OF_PARALLEL,
    OF_LINES,
    OF_ATTRACTION,
    OF_PASTS,
)
_OF_THE_ENSEMBLE = ("summit_height", "summit_radius", "friction", "x", "y", "slope")
SURFACE, CURVES = "surface.", "curves."
_OF_THE_PAIR = (
    "contact_modulus",
    "shear_modulus",
    "hardness",
    "yield_stress",
    "work_of_adhesion",
    "cracking_load",
)
# What each setting has to be.
_OF_SETTINGS: Mapping[str, Any] = {
    **dict.fromkeys(("historysim_version", "made_with", "scenario", "title"), str),
    **dict.fromkeys(("contact_modulus", "shear_modulus", "tolerance"), int | float),
    "seed": int | list | None,
    "lateral_stiffness": int | float | list | None,
    "substeps": int,
    "saturate": bool,
    "record": str | list,
    "surface_attributes": dict,
    "metadata": dict,
}
RESOLUTIONS = ("displacement_resolution", "load_resolution")
# Settings that make asperities evolve: the law of a body in each, and its registry.
LAWS: Mapping[str, tuple[str, Registry[Any]]] = {
    "friction_law": ("friction", FRICTION_LAWS),
    "wear": ("wear", WEAR_LAWS),
    "yielding": ("yielding", YIELDING_LAWS),
    "attraction": ("attraction", ATTRACTIONS),
}


# slots do not allow cached properties
@attrs.frozen(eq=False, slots=False)
class LogHeader:
    """Head of a log: settings and arrays."""

    #: Settings in JSON: versions, the scenario as TOML text with its title and seeds, the moduli
    #: [Pa], tolerance, the lateral stiffness of the instrument [N/m], substeps, saturate, recorded
    #: asperities, and laws of evolution; if known, limits of the pair, nominal area [m²],
    #: resolutions, and metadata.
    settings: Mapping[str, Any]
    #: Of the ensemble, and of the group ``surface`` of the result, with names that begin with
    #: ``surface.``.
    arrays: Mapping[str, Array] = attrs.field(repr=False)

    @classmethod
    def from_replay(
        cls,
        job: Replay,
        *,
        scenario: str = "",
        title: str = "",
        metadata: Mapping[str, str] | None = None,
        seeds: Sequence[int] = (),
        surface: tuple[Mapping[str, Array], Mapping[str, Any]] = ({}, {}),
    ) -> Self:
        """Make the head of a replay, with the texts of its scenario and the arrays and attributes of its surface."""
        ensemble, instrument, record = job.ensemble, job.instrument, job.record
        heights, attributes = surface
        arrays = ensemble.arrays | {f"{SURFACE}{name}": values for name, values in heights.items()}
        laws = {name: ensemble.laws[law] for name, (law, _) in LAWS.items() if law in ensemble.laws}
        resolutions = {name: getattr(instrument, name) for name in RESOLUTIONS}
        limits = dict(ensemble.pair.limits)
        if "yielding" not in laws:
            # which only summits that yield are looked at for
            limits.pop("cracking_load", None)
        settings = {
            "historysim_version": __version__,
            "made_with": made_with(),
            "scenario": scenario,
            "title": title,
            "seed": seeds[0] if len(seeds) == 1 else list(seeds) or None,
            "contact_modulus": ensemble.pair.contact_modulus,
            "shear_modulus": ensemble.pair.shear_modulus,
            "lateral_stiffness": convert_each(
                lambda stiffness: None if stiffness == math.inf else stiffness,
                instrument.lateral_stiffness,
            ),
            "substeps": job.substeps,
            "saturate": bool(job.saturate),
            "record": record if isinstance(record, str) else [int(index) for index in record],
            "surface_attributes": {
                key: value.tolist() if isinstance(value, np.generic | np.ndarray) else value
                for key, value in attributes.items()
            },
            **limits,
            **{name: value for name, value in resolutions.items() if value > 0},
            **{name: law.settings for name, law in laws.items()},
            **ensemble.settings,
        }
        # settings that most logs do not have
        further = {
            "metadata": dict(metadata or {}) or None,
            "parallel_stiffness": instrument.parallel_stiffness or None,
            "past": None if job.past == UNTOUCHED else job.past,
        }
        settings |= {name: value for name, value in further.items() if value is not None}
        settings["format"] = _form(arrays, settings)
        return cls(
            settings,
            {name: values.astype("<f8", order="C", copy=False) for name, values in arrays.items()},
        )

    @property
    def text(self) -> str:
        """The settings as JSON text."""
        return json.dumps(self.settings, sort_keys=True, ensure_ascii=False, allow_nan=False)

    @functools.cached_property
    def link(self) -> bytes:
        """The first link of the chain."""
        return array_digest(sorted(self.arrays.items()), self.text)

    def check(self) -> None:
        """Check that settings have valid types, and make an ensemble and an instrument; otherwise InputError."""
        for name, kinds in _OF_SETTINGS.items():
            value = self.settings.get(name, {} if name == "metadata" else ...)
            if not isinstance(value, kinds) or (isinstance(value, bool) and kinds is not bool):
                raise InputError(
                    f"is damaged: its setting {name} is {format_value(value)}, which is no value for it"
                )
        record, metadata = self.settings["record"], self.settings.get("metadata", {})
        indices = all(type(item) is int for item in record if not isinstance(record, str))
        if not (indices and all(isinstance(item, str) for item in metadata.values())):
            raise InputError(
                "is damaged: what it records are no indices, or its metadata are no strings"
            )
        if (past := self.settings.get("past", UNTOUCHED)) not in PASTS:
            raise InputError(
                f"is damaged: its setting past is {format_value(past)}, which is no value for it"
            )
        if not 1 <= self.substeps <= most("STEPS"):
            raise InputError(f"says {format_value(self.substeps)} as substeps; {at_most('STEPS')}")
        try:
            # either is computed once
            _ = self.ensemble, self.instrument
        except MissingPackageError:
            raise
        except InputError as error:
            raise InputError(f"is damaged: its asperities cannot be used ({error})") from error

    @functools.cached_property
    def ensemble(self) -> Body:
        """The ensemble with all asperities."""
        settings = self.settings
        properties: dict[str, Any] = {
            name: self.arrays[name] for name in _OF_THE_ENSEMBLE if name in self.arrays
        }
        pair = MaterialPair.from_moduli(
            **{name: settings[name] for name in _OF_THE_PAIR if name in settings}
        )
        tolerance, rings = settings["tolerance"], Rings(**settings.get("rings", {}))
        if columns := self._group(CURVES):
            from historysim.asperities.curves import NormalCurves

            friction, curves = float(properties["friction"][0]), NormalCurves(**columns)
            if "line" in settings:
                from historysim.asperities.line_contact import LineContact

                return LineContact(
                    pair, friction=friction, tolerance=tolerance, curves=curves, **settings["line"]
                )
            from historysim.asperities.patches import Patches

            highest = float(properties["summit_height"].max())
            return Patches(
                pair, curves, friction, highest_summit=highest, tolerance=tolerance, rings=rings
            )
        laws = {
            name: law_from_settings(registry, settings[name])
            for name, (_, registry) in LAWS.items()
            if name in settings
        }
        if (law := laws.pop("friction_law", None)) is not None:
            friction = properties["friction"]
            # other versions of NumPy draw other numbers, so the values in the log are used
            drawn_anew = law.depends_on == "nothing" and not np.array_equal(
                law.at_start(friction.size), friction
            )
            properties["friction"] = friction if drawn_anew else law
        properties |= {"tolerance": tolerance, "nominal_area": settings.get("nominal_area")}
        follow_sliding = settings.get("follow_sliding", False)
        if "slope" in properties:
            from historysim.asperities.inclined import InclinedEnsemble

            features: dict[Feature, bool] = {
                "wear": "wear" in laws,
                "yielding": "yielding" in laws,
                "sliding": bool(follow_sliding),
            }
            require(InclinedEnsemble, *(feature for feature, is_set in features.items() if is_set))
            return InclinedEnsemble(pair, **properties)
        return Ensemble(pair, **properties, **laws, follow_sliding=follow_sliding, rings=rings)

    @property
    def instrument(self) -> Instrument:
        """The instrument in series with the contact."""
        stiffness = convert_each(
            lambda value: math.inf if value is None else value, self.settings["lateral_stiffness"]
        )
        names = (*RESOLUTIONS, "parallel_stiffness")
        return Instrument(
            stiffness, **{name: self.settings[name] for name in names if name in self.settings}
        )

    @property
    def substeps(self) -> int:
        """Rows per interval between event times."""
        return int(self.settings["substeps"])

    @property
    def past(self) -> str:
        """Past of the contact before the first event."""
        return str(self.settings.get("past", UNTOUCHED))

    def replay(self, events: Sequence[Event], threads: int | None = None) -> Replay:
        """Return the replay of events with these settings; InputError if it has too many rows."""
        if (steps := len(events) * self.substeps) > most("STEPS"):
            raise InputError(f"the log makes {steps:,} steps; {at_most('STEPS')}")
        return Replay(
            self.ensemble,
            events,
            substeps=self.substeps,
            saturate=bool(self.settings["saturate"]),
            record=self.settings["record"],
            instrument=self.instrument,
            threads=threads,
            hold=False,
            past=self.past,
        )

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the scenario, which are added to the attributes of the replay."""
        named = {name: self.settings[name] for name in ("scenario", "title", "seed")}
        present = {name: value for name, value in named.items() if value not in (None, "")}
        return {**present, **self.settings.get("metadata", {})}

    @property
    def packages(self) -> tuple[str, ...]:
        """External packages that define the laws, with their versions."""
        laws = [self.settings[name] for name in LAWS if name in self.settings]
        return tuple(
            dict.fromkeys(
                " ".join(map(str, law["package"])).rstrip() for law in laws if "package" in law
            )
        )

    @property
    def surface(self) -> dict[str, Array]:
        """Arrays of the surface group of the result."""
        return self._group(SURFACE)

    def _group(self, prefix: str) -> dict[str, Array]:
        return {
            name.removeprefix(prefix): values
            for name, values in self.arrays.items()
            if name.startswith(prefix)
        }


def _form(arrays: Mapping[str, Array], settings: Mapping[str, Any]) -> int:
    """Return the lowest format number that supports the ensemble with these arrays and settings."""
    own = {
        "past": OF_PASTS,
        "attraction": OF_ATTRACTION,
        "line": OF_LINES,
        "parallel_stiffness": OF_PARALLEL,
    }
    if present := [form for name, form in own.items() if name in settings]:
        return present[0]
    if any(name.startswith(CURVES) for name in arrays):
        return OF_CURVES
    if "slope" in arrays:
        return OF_SLOPES
    if "yielding" in settings:
        return OF_YIELDING
    return OF_LAWS if {*LAWS, "follow_sliding"} & {*settings} else PLAIN


def parse_head(text: str, arrays: Mapping[str, Array], link: bytes | None = None) -> LogHeader:
    """Parse the head of a file, and check it if its link is given.

    Raises InputError: a form that this version does not know, or damage. ValueError: it does not
    match its link.
    """
    settings = json.loads(text)
    form = settings.get("format") if isinstance(settings, dict) else settings
    if form not in FORMATS:
        formats = ", ".join(map(str, FORMATS))
        raise InputError(
            f"is a log of form {form!r}; expected one of {formats}; a later version of historysim wrote it"
        )
    head = LogHeader(settings, arrays)
    if link is not None:
        if head.link != link:
            raise ValueError("scenario, seeds or asperities do not match its digest")
        head.check()
    return head
