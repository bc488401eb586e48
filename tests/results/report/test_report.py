"""Contents of the report of a history."""

import re
import shlex
from html import unescape

import pytest
from pairs import COMPLIANT as PAIR

import historysim as hs
from historysim.results.report.reports import (
    history_pictures,
    provenance_sections,
    validity_section,
)

EVENTS = [
    hs.NormalLoad(0.0, 4e-3),
    hs.TangentialDisplacement(1.0, 5e-9),
    hs.TangentialDisplacement(2.0, -5e-9),
]


def replayed(**options):
    return hs.replay(hs.Ensemble(PAIR, [0.0, -2e-8], 1e-5, 0.2), EVENTS, substeps=4, **options)


def sections(text):
    return re.findall(r"<h2>(.*?)</h2>", text)


def test_a_page_has_results_and_provenance(tmp_path):
    history = replayed()
    history.attrs |= {"title": "a <b> & c", "scenario": "[loading]\nsubsteps = 4 # <script>"}
    text = hs.report(history, tmp_path / "r.html")
    assert (tmp_path / "r.html").read_text(encoding="utf-8") == text
    assert sections(text) == [
        "Summary",
        "Validity",
        "Through time",
        "Pictures",
        "Provenance",
        "How to reproduce",
    ]
    assert "<h1>a &lt;b&gt; &amp; c</h1>" in text
    plain = unescape(re.sub("<[^>]*>", " ", text))
    for label, message in hs.show(history):
        assert "\n" in message or (label in plain and message in plain)
    assert "substeps = 4 # <script>" in plain
    assert "4 # <script>" not in text
    assert text.count("data:image/webp;base64,") == 5
    # nothing is fetched
    assert re.findall(r'(?:src|href)="(?!data:)', text) == []


@pytest.mark.parametrize(
    "name, word",
    [
        ("r.nc", "r.nc"),
        ("a b; rm -rf ~ $(id).nc", "'a b; rm -rf ~ $(id).nc'"),
        ("it's.nc", "'it'\"'\"'s.nc'"),
        ("-o.nc", "./-o.nc"),
    ],
)
def test_shell_lines_of_a_page_quote_names_and_take_versions_by_their_form(name, word):
    def commands():
        _, reproduce = provenance_sections(history)
        return unescape(re.sub("<[^>]*>", "\n", "".join(reproduce.parts))).splitlines()

    history = replayed()
    history.encoding["source"] = f"/somewhere/{name}"
    history.attrs |= {"log_digest": "0", "historysim_version": "1.2.3rc1"}
    lines = commands()
    assert {f"historysim run {word} -o again.nc", f"historysim verify {word}"} <= set(lines)
    assert (
        shlex.split(lines[lines.index(f"historysim verify {word}")])[2].removeprefix("./") == name
    )
    assert "pip install historysim==1.2.3rc1" in lines
    for version in ("1.0; rm -rf ~", "1.0\nid", "$(id)", "", "1.0 --index-url http://x"):
        history.attrs["historysim_version"] = version
        assert not any("pip install" in line for line in commands())


def test_findings_are_warnings_with_their_numbers():
    history = hs.replay(hs.Ensemble(PAIR, 0.0, 1e-6, 0.2), [hs.NormalLoad(0.0, 5e-3)])
    (finding,) = history.contact.validity()
    plain = unescape("".join(validity_section(history).parts))
    assert finding.text in plain
    assert f"{finding.value:.3g}" in plain
    assert "All assumptions that are checked hold" in validity_section(replayed()).parts[0]


def test_pictures_that_cannot_be_drawn_are_named():
    changed = [*EVENTS, hs.FrictionChange(3.0, 0.1)]
    history = hs.replay(hs.Ensemble(PAIR, [0.0, -2e-8], 1e-5, 0.2), changed)
    # of its origin nothing is known
    history.encoding.clear()
    (text,) = history_pictures(history, ["traction"])
    assert (
        "No picture traction: asperity 0: the recorded steps leave out part of its load history"
        in text
    )


def test_totals_alone_have_a_page_without_asperities():
    text = hs.report(replayed(record="totals"))
    assert "Not available: the history is of totals alone" in text
    assert text.count("data:image/webp;base64,") == 2
