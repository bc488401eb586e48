"""Scenario files: what they build, and what is said about those that cannot be used."""

from broken import (
    BLOCKS,
    DOCUMENTS,
    FILES,
    MEASURED,
    SPHERE,
    WAYPOINTS,
)
from golden import refused
from pytest import approx, fixture, mark, raises
from sections import LINES, SECTIONS, section

from historysim.errors import InputError
from historysim.loads.events import (
    NormalLoad,
    TangentialDisplacement,
    TangentialLoad,
)
from historysim.scenario import scenario


@fixture
def folder(tmp_path):
    for name, content in FILES.items():
        (tmp_path / name).write_text(content, encoding="utf-8")
    return tmp_path


def loaded(folder, text):
    path = folder / "s.toml"
    path.write_text(text, encoding="utf-8")
    return scenario.load(path)


def built(folder, text):
    found = loaded(folder, text)
    return found.ensemble(), found.events()


def refusal(folder, text):
    with raises(InputError) as refused:
        loaded(folder, text).build()
    return str(refused.value)


def with_loading(loading):
    return f"{SPHERE}[loading]\n{loading}\n"


# -- what scenarios build --------------------------------------------------------------------------


def test_waypoints_are_events_at_their_times(folder):
    found = loaded(folder, WAYPOINTS)
    assert found.events() == [NormalLoad(0.0, 0.01), TangentialLoad(1.0, 0.003)]
    assert (
        found.sections.loading.substeps,
        found.sections.loading.saturate,
        found.sections.record.asperities,
        found.title,
    ) == (1, False, "touching", "")
    assert found.text == WAYPOINTS


def test_inline_summits_and_a_custom_material(folder):
    ensemble, _ = built(folder, BLOCKS)
    assert ensemble.summit_height.tolist() == [0.0, 1e-8, 2e-8]
    assert ensemble.summit_radius.tolist() == [2e-5] * 3
    assert ensemble.friction.tolist() == [0.1, 0.2, 0.3]
    assert ensemble.x.tolist() == [0.0, 1e-5, 2e-5]
    assert ensemble.pair.contact_modulus == approx(
        1 / ((1 - 0.28**2) / 112e9 + (1 - 0.2**2) / 64e9)
    )


def test_metadata_are_free_names_that_do_not_replace_computed_attributes(folder):
    found = loaded(
        folder, f'{WAYPOINTS}\n[metadata]\noperator = "A. B."\nkeywords = ["a", "b"]\nrun = 7\n'
    )
    assert found.metadata == {"operator": "A. B.", "keywords": "a, b", "run": "7"}
    for entry, message in (
        (
            "source = 'mine'",
            "metadata.source: describes how a result was computed; choose another name, such as my_",
        ),
        ("'two words' = 'x'", "is not the name of an attribute"),
        ("flag = true", "metadata.flag: true; expected a string"),
    ):
        assert message in refusal(folder, f"{WAYPOINTS}\n[metadata]\n{entry}\n")


def test_blocks_run_their_loops_at_each_load(folder):
    found = loaded(folder, BLOCKS)
    events = found.events()
    normal = [event for event in events if isinstance(event, NormalLoad)]
    moved = [event for event in events if isinstance(event, TangentialDisplacement)]
    levels = [(1.0, 0.05), (5.0, 0.05), (6.0, 0.07), (10.0, 0.07), (11.0, 0.09)]
    assert [(event.time, event.value) for event in normal] == levels
    peaks = [event.value for event in moved if event.value]
    assert peaks == [1e-7, -1e-7] * 12
    assert [event.time for event in events] == sorted(event.time for event in events)
    assert found.sections.record.asperities == (0, 2)


def test_channels_that_a_block_does_not_name_are_held(folder):
    blocks = """
    [[loading.blocks]]
    waypoints = [{ after = 1, normal_load = 1 }, { after = 1, tangential_load = 0.1 }]
    [[loading.blocks]]
    each = { after = 1, normal_load = [2] }
    waypoints = [{ after = 1, tangential_load = 0.2 }]
    """
    _, events = built(folder, SPHERE + blocks)
    assert events == [
        NormalLoad(1.0, 1.0),
        TangentialLoad(2.0, 0.1),
        NormalLoad(2.0, 1.0),
        NormalLoad(3.0, 2.0),
        TangentialLoad(3.0, 0.1),
        TangentialLoad(4.0, 0.2),
    ]


def test_tables_give_summits_friction_and_loads(folder):
    found = loaded(folder, MEASURED)
    ensemble = found.ensemble()
    assert ensemble.summit_height.tolist() == approx([0.0, 12.5e-9])
    assert ensemble.summit_radius.tolist() == [1e-5, 2e-5]
    assert ensemble.friction.tolist() == [0.2, 0.1]
    events = found.events()
    assert [type(event) for event in events] == [NormalLoad, TangentialDisplacement] * 3
    assert [event.time for event in events] == [0.0, 0.0, 0.5, 0.5, 1.0, 1.0]
    assert [event.value for event in events] == approx([0.05, 0.0, 0.05, 1e-7, 0.0505, -1e-7])
    assert (
        found.sections.loading.substeps,
        found.sections.loading.saturate,
        found.sections.record.asperities,
    ) == (
        2,
        True,
        "totals",
    )


# -- what is said about those that cannot be used --------------------------------------------------


def test_all_problems_are_named_at_once(folder):
    text = WAYPOINTS.replace("radius = 1.0", 'radius = "1 s"').replace("coefficient", "koefficient")
    message = refusal(folder, text)
    lines = message.splitlines()
    # the radius, the key that is not known, and the one that is then missing
    assert len(lines) == 3
    assert all(line.startswith("s.toml: ") for line in lines)


def test_a_flood_of_problems_is_cut_short(folder):
    text = with_loading("waypoints = [" + "{ time = true }," * 1000 + "]")
    message = refusal(folder, text)
    assert len(message.splitlines()) == 11
    assert "… and 990 more" in message


@mark.parametrize(
    "content, said",
    [
        (b"", "s.toml: is empty"),
        (b"\xff\xfe", "s.toml: is not UTF-8 text"),
        (b"a = " + b"[" * 100_000, "s.toml: is not TOML"),
    ],
)
def test_files_that_are_no_scenario(tmp_path, content, said):
    path = tmp_path / "s.toml"
    path.write_bytes(content)
    with raises(InputError) as refused:
        scenario.load(path)
    assert said in str(refused.value)


@mark.parametrize("document", DOCUMENTS)
def test_the_documents_that_are_broken_elsewhere_are_good(folder, document):
    assert built(folder, document)


def test_as_many_steps_as_are_allowed_are_taken(tmp_path, monkeypatch):
    more = LINES.replace("normal_load = 0 }", "normal_load = 0 }, { time = 1, normal_load = 1 }")
    found = loaded(tmp_path, section(SECTIONS["sphere"]) + more + "substeps = 5\n")
    steps = 5 * len(found.events())
    monkeypatch.setenv("HISTORYSIM_MOST_STEPS", str(steps))
    assert found.events()
    monkeypatch.setenv("HISTORYSIM_MOST_STEPS", str(steps - 1))
    with refused("steps; expected"):
        found.events()
