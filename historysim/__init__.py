"""historysim: event-sourced load-history simulator for rough frictional contacts before they slide.

Names are imported when they are first used, so that importing the package costs nothing.
"""

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from historysim._version import __version__
from historysim.errors import FrictionLimitError, HistorySimError, InputError, LoadError

# type checkers read these, a program the homes below; a test says that both are the same
if TYPE_CHECKING:
    from historysim.asperities.asperity import Asperity as Asperity
    from historysim.asperities.asperity import SlipState as SlipState
    from historysim.asperities.contact_batch import ContactBatch as ContactBatch
    from historysim.asperities.ensemble import Ensemble as Ensemble
    from historysim.asperities.instrument import Instrument as Instrument
    from historysim.asperities.state import EnsembleState as EnsembleState
    from historysim.contact.greenwood_williamson import GreenwoodWilliamson as GreenwoodWilliamson
    from historysim.contact.materials import Material as Material
    from historysim.contact.materials import MaterialPair as MaterialPair
    from historysim.contact.materials import material as material
    from historysim.exchange.fmu.writing import write_fmu as write_fmu
    from historysim.exchange.reduced.reducing import reduce as reduce
    from historysim.exchange.reduced.writing import write_reduced as write_reduced
    from historysim.interaction.solutions import NormalSolutions as NormalSolutions
    from historysim.loads.events import FrictionChange as FrictionChange
    from historysim.loads.events import FrictionRamp as FrictionRamp
    from historysim.loads.events import GeometryChange as GeometryChange
    from historysim.loads.events import NormalDisplacement as NormalDisplacement
    from historysim.loads.events import NormalLoad as NormalLoad
    from historysim.loads.events import TangentialDisplacement as TangentialDisplacement
    from historysim.loads.events import TangentialLoad as TangentialLoad
    from historysim.log.event_log import EventLog as EventLog
    from historysim.log.verification import verify as verify
    from historysim.memory import get_include as get_include
    from historysim.replay import Replay as Replay
    from historysim.replay import replay as replay
    from historysim.results import analysis as analysis
    from historysim.results.csv_table import write_csv as write_csv
    from historysim.results.netcdf_table import write_netcdf as write_netcdf
    from historysim.results.plots.adhesion_branch import plot_adhesion_branch as plot_adhesion_branch
    from historysim.results.plots.adhesion_map import plot_adhesion_map as plot_adhesion_map
    from historysim.results.plots.animation import animate_contact_map as animate_contact_map
    from historysim.results.plots.animation import save_animation as save_animation
    from historysim.results.plots.asperity import plot_asperity as plot_asperity
    from historysim.results.plots.comparison import plot_comparison as plot_comparison
    from historysim.results.plots.contact_map import plot_contact_map as plot_contact_map
    from historysim.results.plots.history import plot_history as plot_history
    from historysim.results.plots.loop import plot_loop as plot_loop
    from historysim.results.plots.loops import plot_loops as plot_loops
    from historysim.results.plots.slip_map import plot_slip_map as plot_slip_map
    from historysim.results.plots.stiffness import plot_stiffness as plot_stiffness
    from historysim.results.plots.summit_scatter import plot_heights as plot_heights
    from historysim.results.plots.summit_scatter import plot_summit_scatter as plot_summit_scatter
    from historysim.results.plots.surface import plot_distribution as plot_distribution
    from historysim.results.plots.surface import plot_surface as plot_surface
    from historysim.results.plots.swept import plot_bars as plot_bars
    from historysim.results.plots.swept import plot_swept as plot_swept
    from historysim.results.plots.together import LoopMarks as LoopMarks
    from historysim.results.plots.together import plot_together as plot_together
    from historysim.results.plots.traction import plot_slip_fronts as plot_slip_fronts
    from historysim.results.plots.traction import plot_traction as plot_traction
    from historysim.results.plots.wear import plot_wear as plot_wear
    from historysim.scenario.compare import compare as compare
    from historysim.scenario.fit import fit as fit
    from historysim.scenario.loops import find_loops as find_loops
    from historysim.scenario.plot import plot as plot
    from historysim.scenario.report import report as report
    from historysim.scenario.run import run as run
    from historysim.scenario.scenario import load as load
    from historysim.scenario.show import show as show
    from historysim.scenario.sliding import find_sliding as find_sliding
    from historysim.studies import design_studies as design_studies
    from historysim.studies.design import design as design
    from historysim.studies.gallery import gallery as gallery
    from historysim.studies.spread import drift_along as drift_along
    from historysim.studies.spread import spread as spread
    from historysim.studies.sweep import sweep as sweep
    from historysim.surfaces.distribution import drawn_summits as drawn_summits
    from historysim.surfaces.distribution import quantile_summits as quantile_summits
    from historysim.surfaces.heights import Surface as Surface
    from historysim.surfaces.random import random_surface as random_surface
    from historysim.surfaces.reading import read_surface as read_surface
    from historysim.surfaces.summits import Summits as Summits
    from historysim.surfaces.textured import textured_summits as textured_summits

_HOMES = {
    "asperities.asperity": ("Asperity", "SlipState"),
    "asperities.contact_batch": ("ContactBatch",),
    "asperities.ensemble": ("Ensemble",),
    "asperities.instrument": ("Instrument",),
    "asperities.state": ("EnsembleState",),
    "contact.greenwood_williamson": ("GreenwoodWilliamson",),
    "contact.materials": ("Material", "MaterialPair", "material"),
    "exchange.fmu.writing": ("write_fmu",),
    "exchange.reduced.reducing": ("reduce",),
    "exchange.reduced.writing": ("write_reduced",),
    "interaction.solutions": ("NormalSolutions",),
    "loads.events": (
        "FrictionChange",
        "FrictionRamp",
        "GeometryChange",
        "NormalDisplacement",
        "NormalLoad",
        "TangentialDisplacement",
        "TangentialLoad",
    ),
    "log.event_log": ("EventLog",),
    "log.verification": ("verify",),
    "memory": ("get_include",),
    "replay": ("Replay", "replay"),
    "results": ("analysis",),
    "results.csv_table": ("write_csv",),
    "results.netcdf_table": ("write_netcdf",),
    "results.plots.adhesion_branch": ("plot_adhesion_branch",),
    "results.plots.adhesion_map": ("plot_adhesion_map",),
    "results.plots.animation": ("animate_contact_map", "save_animation"),
    "results.plots.asperity": ("plot_asperity",),
    "results.plots.comparison": ("plot_comparison",),
    "results.plots.contact_map": ("plot_contact_map",),
    "results.plots.history": ("plot_history",),
    "results.plots.loop": ("plot_loop",),
    "results.plots.loops": ("plot_loops",),
    "results.plots.slip_map": ("plot_slip_map",),
    "results.plots.stiffness": ("plot_stiffness",),
    "results.plots.surface": ("plot_distribution", "plot_surface"),
    "results.plots.summit_scatter": ("plot_heights", "plot_summit_scatter"),
    "results.plots.swept": ("plot_bars", "plot_swept"),
    "results.plots.together": ("LoopMarks", "plot_together"),
    "results.plots.traction": ("plot_slip_fronts", "plot_traction"),
    "results.plots.wear": ("plot_wear",),
    "scenario.compare": ("compare",),
    "scenario.fit": ("fit",),
    "scenario.loops": ("find_loops",),
    "scenario.sliding": ("find_sliding",),
    "scenario.plot": ("plot",),
    "scenario.report": ("report",),
    "scenario.run": ("run",),
    "scenario.scenario": ("load",),
    "scenario.show": ("show",),
    "studies": ("design_studies",),
    "studies.design": ("design",),
    "studies.spread": ("drift_along", "spread"),
    "studies.gallery": ("gallery",),
    "studies.sweep": ("sweep",),
    "surfaces.distribution": ("drawn_summits", "quantile_summits"),
    "surfaces.heights": ("Surface",),
    "surfaces.random": ("random_surface",),
    "surfaces.reading": ("read_surface",),
    "surfaces.summits": ("Summits",),
    "surfaces.textured": ("textured_summits",),
}
_ROOMS_OF_HISTORIES = {"replay", "log", "results", "scenario", "studies"}
_HOME_OF = {name: f"{__name__}.{home}" for home, names in _HOMES.items() for name in names}

__all__ = [  # noqa: PLE0604 - the names of _HOMES are texts, which the linter cannot see
    "FrictionLimitError",
    "HistorySimError",
    "InputError",
    "LoadError",
    "__version__",
    *_HOME_OF,
]


class _Package(ModuleType):
    """A package in which a public name outlives the import of a module of the same name."""

    def __setattr__(self, name: str, value: Any) -> None:
        # `historysim.replay` is the function; the import system would put its module in that place
        if not (name in _HOME_OF and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


# a type checker that knew of it would take any name for one of the package
if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        if name not in _HOME_OF:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        home = importlib.import_module(_HOME_OF[name])
        if home.__name__.split(".")[1] in _ROOMS_OF_HISTORIES:
            # histories get their questions: history.contact
            importlib.import_module(f"{__name__}.results.accessor")
        # a module that nobody has imported yet is no attribute of its package
        return getattr(home, name, None) or importlib.import_module(f"{home.__name__}.{name}")


def __dir__() -> list[str]:
    return sorted(__all__)
