"""The pages of the interface: every public name, from its docstring, by what a user is after."""

import importlib
import inspect
from types import ModuleType

import historysim as hs
from historysim.results import queries
from historysim.results.accessor import Queries

GROUPS = {
    "Run, ask and draw": (
        "run replay Replay open load Scenario validate show plot report explore kinds write_csv write_netcdf"
    ),
    "Contacts": (
        "Material MaterialPair material Ensemble Patches State Stepper Rings Asperity SlipState Instrument ContactBatch"
    ),
    "Loads": "NormalLoad NormalDisplacement TangentialLoad TangentialDisplacement FrictionChange",
    "Surfaces": "Surface Summits random_surface read_surface register_maps area_laws",
    "Measured records": "columns loops sliding compare creep fit Loops Fit",
    "Many runs": "sweep sweep_statistics design gallery",
    "The event log": "EventLog verify",
    "Errors": "HistorySimError InputError LoadError FrictionLimitError RampWarning UnlikelyValueWarning",
    "Into other programs": "write_fmu reduce get_include",
}
"""What a user is after, and the names for it. Public names that stand in none get a page of their own."""


EARLIER = {"contact"}
"""Earlier names of namespaces, which are documented under their present ones."""

QUESTIONS = """\
`history.contact.NAME(…)` asks a history, as in `hs.open("my.nc").contact.slides_first()`. Each question is a function
of the history, which the method passes for you. `history.contact.asperity(55, "held")` is an asperity as an object: an
`hs.Asperity` with its traction, reversal points and slip state.
"""


def _at(path: str) -> object:
    found: object = hs
    for name in path.split(".")[1:]:
        found = getattr(found, name)
    return found


def groups() -> dict[str, list[str]]:
    """Return the names of the package itself, group by group."""
    found = {
        title: [f"historysim.{name}" for name in names.split()] for title, names in GROUPS.items()
    }
    known = {name for names in found.values() for name in names}
    public = [f"historysim.{name}" for name in dir(hs) if not name.startswith("_")]
    others = [
        path for path in public if path not in known and not isinstance(_at(path), ModuleType)
    ]
    return found | ({"Further names": others} if others else {})


def namespaces() -> dict[str, list[str]]:
    """Return the names of each namespace, and of those in it, that have no place in the package itself."""
    known = {id(_at(path)) for paths in groups().values() for path in paths}
    known |= {id(inspect.unwrap(getattr(Queries, name))) for name in all_queries()}
    found: dict[str, list[str]] = {}
    waiting = [f"historysim.{name}" for name in dir(hs) if name not in EARLIER]
    for path in waiting:
        module = _at(path)
        if not isinstance(module, ModuleType):
            continue
        listed = getattr(module, "__all__", None)
        names = []
        for name in sorted(vars(module) if listed is None else listed):
            what = getattr(module, name)
            own = listed is not None or getattr(what, "__module__", None) == module.__name__
            if isinstance(what, ModuleType):
                waiting += [f"{path}.{name}"] if listed is not None else []
            elif callable(what) and own and not name.startswith("_") and id(what) not in known:
                names.append(f"{module.__name__}.{name}")
                known.add(id(what))
        if names:
            found[f"hs.{path.partition('.')[2]}"] = names
    return found


def all_queries() -> list[str]:
    """Return the questions to a history."""
    return list(queries.all_queries())


def _question(name: str) -> str:
    asked = inspect.unwrap(getattr(Queries, name))
    return f"{asked.__module__}.{asked.__name__}"


def _documented(path: str) -> str:
    module, _, name = path.rpartition(".")
    kind = (
        "class" if inspect.isclass(getattr(importlib.import_module(module), name)) else "function"
    )
    members = "\n   :members:" if kind == "class" else ""
    return f"```{{eval-rst}}\n.. auto{kind}:: {path}{members}\n```"


def _listed(paths: list[str]) -> str:
    names = "\n".join(f"   ~{path}" for path in paths)
    return f"```{{eval-rst}}\n.. autosummary::\n   :nosignatures:\n\n{names}\n```"


def pages() -> dict[str, str]:
    """Return the pages by their names."""
    chapters = [(title, "", paths) for title, paths in groups().items()]
    chapters.append(
        ("Questions to a history", QUESTIONS, [_question(name) for name in all_queries()])
    )
    for path, paths in namespaces().items():
        module = _at("historysim" + path.removeprefix("hs"))
        chapters.append((f"`{path}`", (inspect.getdoc(module) or "").strip(), paths))
    made, links = {}, []
    parts = [
        "# Interface",
        "`import historysim as hs` gives all of these names. Each is loaded when it is first used.",
    ]
    for title, text, paths in chapters:
        page = "interface/" + title.strip("`").lower().replace(" ", "_").replace(",", "").replace(
            ".", "_"
        )
        made[f"{page}.md"] = "\n\n".join([f"# {title}", text, *map(_documented, paths)]) + "\n"
        links.append(page)
        parts += [f"## [{title}]({page}.md)", _listed(paths)]
    listed = "\n".join(links)
    parts.append(f"```{{toctree}}\n:hidden:\n\n{listed}\n```")
    return made | {"interface.md": "\n\n".join(parts) + "\n"}
