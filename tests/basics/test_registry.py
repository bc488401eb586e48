"""Kinds by their names: from this package, from a script, and from entry points."""

import attrs
import pytest
from golden import refused

from historysim.asperities.laws import LAWS, FrictionLaw, register
from historysim.basics.fields import Number, at_least
from historysim.basics.registry import Registry
from historysim.errors import MissingPackageError


@pytest.fixture
def own():
    @register
    @attrs.frozen
    class Own(FrictionLaw):
        """A law of a script."""

        number: Number = attrs.field(default=2.0, validator=at_least(0.0))
        kind, depends_on, text = "own", "own", "of a test"

    yield Own
    LAWS.forget("own")


def entry(folder, package, points, group="historysim.laws"):
    info = folder / f"{package}-0.1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {package}\nVersion: 0.1\n", encoding="utf-8"
    )
    (info / "entry_points.txt").write_text(f"[{group}]\n{points}\n", encoding="utf-8")


def test_what_a_script_registers_is_known_until_it_is_forgotten(own):
    assert LAWS["own"] is own
    assert FrictionLaw.from_settings(own(3.0).settings) == own(3.0)
    assert own().settings["package"] == [__name__, ""]
    settings = own().settings
    LAWS.forget("own")
    assert "own" not in LAWS
    with pytest.raises(MissingPackageError, match=f"is of {__name__}, which is not there"):
        FrictionLaw.from_settings(settings)
    with refused("cannot be written down: Own is not known by that name"):
        _ = own().settings


def test_a_name_belongs_to_one_class(own):
    assert own.kind == "own"

    class Other(FrictionLaw):
        kind = "own"

    with refused(r"is .*Own already; expected another name"):
        register(Other)
    Other.kind = ""
    with refused("Other has '' as its kind"):
        register(Other)


def test_a_name_of_this_package_is_never_replaced(tmp_path, monkeypatch):
    entry(tmp_path, "thief", "power = json:JSONEncoder")
    monkeypatch.syspath_prepend(tmp_path)
    assert LAWS["power"].__module__ == "historysim.asperities.laws.built_in"


@pytest.mark.parametrize(
    "points, said",
    [
        (
            "other = json:JSONEncoder",
            "of the package a is .*JSONEncoder.*; expected a subclass of historysim.asperities",
        ),
        ("other = nowhere:none", "of the package a cannot be loaded from nowhere:none"),
    ],
)
def test_an_entry_point_that_is_no_law_is_named(tmp_path, monkeypatch, points, said):
    entry(tmp_path, "a", points)
    monkeypatch.syspath_prepend(tmp_path)
    with refused(said):
        LAWS.lookup("other")


def test_one_name_of_two_packages_is_an_error(tmp_path, monkeypatch):
    entry(tmp_path, "a", "other = json:JSONEncoder")
    entry(tmp_path, "b", "other = json:JSONDecoder")
    monkeypatch.syspath_prepend(tmp_path)
    with refused(r"'other' is declared by . and .; uninstall one of them"):
        LAWS.lookup("other")


def test_an_empty_registry_has_nothing():
    empty = Registry("historysim.nothing", "builtins:object", "thing")
    assert list(empty) == []
    with refused("none is expected here"):
        empty.lookup("a")
