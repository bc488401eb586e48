# The public names, each with the place where it stands.

from historysim import contact as contact
from historysim import contact as theory  # noqa: F401 - reached as hs.theory
from historysim import coupling as coupling
from historysim import surfaces as surfaces
from historysim._version import __version__ as __version__
from historysim.asperities import attraction as attraction
from historysim.asperities import laws as laws
from historysim.asperities import wear as wear
from historysim.asperities import yielding as yielding
from historysim.asperities.asperity import Asperity as Asperity
from historysim.asperities.asperity import SlipState as SlipState
from historysim.asperities.contact_batch import ContactBatch as ContactBatch
from historysim.asperities.ensemble import Ensemble as Ensemble
from historysim.asperities.inclined import InclinedEnsemble as InclinedEnsemble
from historysim.asperities.instrument import Instrument as Instrument
from historysim.asperities.instrument import Rings as Rings
from historysim.asperities.line_contact import LineContact as LineContact
from historysim.asperities.patches import Patches as Patches
from historysim.asperities.state import State as State
from historysim.asperities.stepper import Stepper as Stepper
from historysim.contact.materials import Material as Material
from historysim.contact.materials import MaterialPair as MaterialPair
from historysim.contact.materials import material as material
from historysim.errors import FrictionLimitError as FrictionLimitError
from historysim.errors import HistorySimError as HistorySimError
from historysim.errors import InputError as InputError
from historysim.errors import LoadError as LoadError
from historysim.errors import RampWarning as RampWarning
from historysim.errors import UnlikelyValueWarning as UnlikelyValueWarning
from historysim.exchange.fmu.unit_file import write_fmu as write_fmu
from historysim.exchange.reduced.reducing import reduce as reduce
from historysim.interaction.areas import area_laws as area_laws
from historysim.loads import events as events
from historysim.loads.events import FrictionChange as FrictionChange
from historysim.loads.events import NormalDisplacement as NormalDisplacement
from historysim.loads.events import NormalLoad as NormalLoad
from historysim.loads.events import TangentialDisplacement as TangentialDisplacement
from historysim.loads.events import TangentialLoad as TangentialLoad
from historysim.log.event_log import EventLog as EventLog
from historysim.log.verification import verify as verify
from historysim.measured.loops import Loops as Loops
from historysim.memory import get_include as get_include
from historysim.replaying import Replay as Replay
from historysim.replaying import replay as replay
from historysim.results import analysis as analysis
from historysim.results import history_drift as drift  # noqa: F401 - reached as hs.drift
from historysim.results import plots as plots
from historysim.results.tables import write_csv as write_csv
from historysim.results.tables import write_netcdf as write_netcdf
from historysim.scenario.fit import Fit as Fit
from historysim.scenario.fit import compare as compare
from historysim.scenario.fit import creep as creep
from historysim.scenario.fit import fit as fit
from historysim.scenario.kinds import kinds as kinds
from historysim.scenario.run import run as run
from historysim.scenario.scenario import Scenario as Scenario
from historysim.scenario.scenario import load as load
from historysim.studies.design import design as design
from historysim.studies.gallery import gallery as gallery
from historysim.studies.record_search import loops as loops
from historysim.studies.record_search import sliding as sliding
from historysim.studies.shortest import shortest as shortest
from historysim.studies.sweep import sweep as sweep
from historysim.studies.sweep_table import sweep_statistics as sweep_statistics
from historysim.studies.validation import validate as validate
from historysim.surfaces.heights import Surface as Surface
from historysim.surfaces.random import random_surface as random_surface
from historysim.surfaces.reading import read_surface as read_surface
from historysim.surfaces.registration import register_maps as register_maps
from historysim.surfaces.summits import Summits as Summits
from historysim.tables import describe as columns  # noqa: F401 - reached as hs.columns
from historysim.verbs import explore as explore
from historysim.verbs import open as open  # noqa: A004 - called as that of xarray
from historysim.verbs import plot as plot
from historysim.verbs import report as report
from historysim.verbs import show as show

# isort: split
# earlier places, which dir() leaves out
from historysim.contact.greenwood_williamson import GreenwoodWilliamson as GreenwoodWilliamson
from historysim.interaction.solutions import NormalSolutions as NormalSolutions
from historysim.loads.events import FrictionRamp as FrictionRamp
from historysim.loads.events import GeometryChange as GeometryChange
from historysim.studies.sweep_table import drift_along as drift_along
from historysim.studies.sweep_table import sweep_statistics as spread  # noqa: F401 - reached as hs.spread
from historysim.surfaces.distribution import drawn_summits as drawn_summits
from historysim.surfaces.distribution import quantile_summits as quantile_summits
from historysim.surfaces.distribution import textured_summits as textured_summits
from historysim.surfaces.registration import register_maps as registered  # noqa: F401 - reached as hs.registered
