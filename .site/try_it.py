"""The page *Try it*: a contact and a load path of the reader's, computed in the browser from one file."""

from pathlib import Path

from historysim.results.report import browser
from historysim.results.report.page import Section, page

SCRIPT = Path(__file__).with_name("try_it.js")
# name, label, attributes of the input, factor to SI
FIELDS = (
    ("radius", "radius (µm)", 'min="0.001" step="any" value="2500"', 1e-6),
    ("count", "asperities", 'min="2" max="2000" step="1" value="50"', 1),
    ("deviation", "height deviation (nm)", 'min="0" step="any" value="30"', 1e-9),
    ("seed", "seed", 'min="0" step="1" value="1"', 1),
    ("modulus", "E* (GPa)", 'min="0.000001" step="any" value="40"', 1e9),
    ("shear", "G* (GPa)", 'min="0.000001" step="any" value="8"', 1e9),
    ("friction", "friction", 'min="0" max="10" step="any" value="0.2"', 1),
    ("most_load", "largest N (mN)", 'min="0.000001" step="any" value="100"', 1e-3),
    ("most_displacement", "largest U (nm)", 'min="0.001" step="any" value="60"', 1e-9),
)
PANELS = {
    "plane": "Load path: draw here with the mouse or a finger, or with the arrow keys",
    "loop": "Friction loop",
    "loads": "Tangential load and friction limit",
    "traction": "Traction of the highest asperity",
}
INTRODUCTION = (
    "<p>Choose a contact and draw how it is loaded. Or drop a CSV file with columns of time, N or approach, and U or "
    "T, such as <code>time (s), N (mN), U (nm)</code>. Everything is computed in this page; nothing leaves it.</p>"
)


def render() -> str:
    """Render the page as HTML."""
    library = browser.encode(browser.LIBRARY.read_bytes())
    scripts = "".join(
        f"<script>\n{file.read_text(encoding='utf-8')}</script>\n"
        for file in (browser.SCRIPT, SCRIPT)
    )
    fields = "".join(
        f'<span class="control"><label for="{name}">{label}</label><input type="number" id="{name}" data-part="{name}" '
        f'data-factor="{factor}" {attributes}></span>'
        for name, label, attributes, factor in FIELDS
    )
    kinds = (
        '<option value="ball">a ball on a flat</option>'
        '<option value="drawn">asperities of Gaussian heights</option>'
    )
    focus = {"plane": ' tabindex="0" style="touch-action: none; cursor: crosshair"'}
    panels = "".join(
        f"<figure><figcaption>{title}</figcaption>"
        f'<svg data-part="{name}" role="img" aria-label="{title}"{focus.get(name, "")}></svg></figure>'
        for name, title in PANELS.items()
    )
    buttons = (("example", "example"), ("clear", "clear"), ("download", "download as scenario"))
    body = (
        f'{INTRODUCTION}<div class="explorer" id="trial"><p class="controls"><span class="control">'
        f'<label for="kind">contact</label><select id="kind" data-part="kind">{kinds}</select></span>{fields}</p>'
        '<p class="controls"><span class="control"><label for="file">CSV file</label>'
        '<input type="file" id="file" data-part="file" accept=".csv,.txt,.tsv"></span>'
        + "".join(
            f'<button type="button" data-part="{name}">{label}</button>' for name, label in buttons
        )
        + '</p><p data-part="message" role="alert" class="warning"></p><p data-part="shown" aria-live="polite"></p>'
        '<p class="controls"><span class="control"><label for="time">time</label>'
        '<input type="range" id="time" data-part="time" min="0" max="0"></span></p>'
        f'<div class="panels">{panels}</div></div>'
        f'<script type="text/plain" id="library">{library}</script>'
        '<script>Trial.open(document.getElementById("trial"));</script>'
    )
    return page("Try historysim", [Section("A contact of your own", (body,))], head=scripts)
