"""Every key of a scenario with a wrong value, missing and misspelt: messages that name its path, and no file left."""

import copy
import math
import tomllib
from pathlib import Path

import pages
import pytest
from broken import keep_small, places, toml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sections import LINES, SECTIONS, section, write_files

from historysim.errors import InputError
from historysim.scenario import scenario

ROOT = Path(__file__).parents[2]
EXAMPLES = pages.blocks((ROOT / "scenarios" / "keys.md").read_text(encoding="utf-8"))
BASE = """
materials = { first = "silicon", second = "float glass" }
surface = { kind = "sphere", radius = "2.5 mm" }
friction = { coefficient = 0.2 }
loading = { waypoints = [{ time = 0, normal_load = "50 mN", tangential_displacement = 0 }] }
"""
# with the examples of keys.md, which have every section; and with every key of every kind of
# surface
DOCUMENTED = [
    tomllib.loads(BASE)
    | tomllib.loads(
        text.replace("[256, 256]", "[16, 16]").replace('length = "20 µm"', 'length = "4 µm"')
    )
    for _, _, text in EXAMPLES
    if text.startswith("[") and "[fit]" not in text
]
SURFACES = [tomllib.loads(section(entry) + LINES) for entry in SECTIONS.values()]
WHOLE = [*DOCUMENTED, *SURFACES]
KEYS = [
    (document, place)
    for document in WHOLE
    for place in places(document)
    # the tables in which users choose the keys
    if place and isinstance(place[-1], str) and not {"over", "groups", "metadata"} & set(place)
]
WRONG_VALUES = (
    True,
    "nonsense",
    {"a": 1},
    [[1]],
    [],
    math.nan,
    -1,
    2**70,
    10**400,
    "5 kg",
    "1e999 m",
)
every = settings(
    deadline=None, max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    keep_small(monkeypatch)
    write_files(tmp_path)
    (tmp_path / "data").symlink_to(ROOT / "data")
    return tmp_path


def message_of(folder, document, change):
    """Return what is wrong with a changed copy of a document, empty if nothing is; nothing else may be raised."""
    document = copy.deepcopy(document)
    change(document)
    path, before = folder / "s.toml", set(folder.iterdir())
    path.write_text(
        "\n".join(f"{toml(key)} = {toml(value)}" for key, value in document.items()),
        encoding="utf-8",
    )
    try:
        scenario.load(path).build()
    except InputError as error:
        message = str(error)
        assert all(line.startswith(("s.toml: ", "…")) for line in message.splitlines()), message
        assert max(map(len, message.splitlines())) < 560, message
        return message
    finally:
        assert set(folder.iterdir()) <= {path, *before}
    return ""


def table_of(document, place):
    """Return the table that holds a key."""
    for step in place[:-1]:
        document = document[step]
    return document


def test_the_documents_are_good(folder):
    assert [
        message for document in WHOLE if (message := message_of(folder, document, lambda _: None))
    ] == []


@every
@given(key=st.sampled_from(KEYS))
def test_a_misspelt_key_is_named_with_its_path_and_the_right_one(folder, key):
    document, place = key
    wrong = place[-1] + place[-1][-1]

    def rename(changed):
        table = table_of(changed, place)
        table[wrong] = table.pop(place[-1])

    message = message_of(folder, document, rename)
    # a table without its kind or law has no keys that are known
    assert (place[-1] if place[-1] in {"kind", "law"} else wrong) in message
    assert place[0] in message or len(place) == 1


@every
@given(key=st.sampled_from(KEYS))
def test_a_missing_key_is_named_or_not_needed(folder, key):
    document, place = key
    message = message_of(folder, document, lambda changed: table_of(changed, place).pop(place[-1]))
    assert not message or place[-1] in message or place[0] in message


@every
@pytest.mark.filterwarnings("ignore::historysim.errors.UnlikelyValueWarning")
@given(key=st.sampled_from(KEYS), value=st.sampled_from(WRONG_VALUES))
def test_a_value_of_a_wrong_type_unit_or_size_is_named_with_its_path(folder, key, value):
    document, place = key
    message = message_of(
        folder, document, lambda changed: table_of(changed, place).update({place[-1]: value})
    )
    assert not message or place[-1] in message or place[0] in message
