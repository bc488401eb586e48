"""A page in headless Chromium, without a network: what it shows, what it asks for, and what its console says."""

import contextlib
import shutil

import pytest

CHROMIUM = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
TALK = ("log", "info", "debug")


@contextlib.contextmanager
def opened(path, *, width=1150, dark=False):
    """Yield a page that a file was opened in; afterwards nothing else was asked for, and no error was told."""
    playwright = pytest.importorskip("playwright.sync_api", reason="no playwright to drive a browser")
    program = next(filter(None, map(shutil.which, CHROMIUM)), None)
    if program is None:
        pytest.skip("no Chromium to open a report in; apt-get install chromium")
    complaints, requests = [], []
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=["--no-sandbox"])
        scheme = "dark" if dark else "light"
        viewport = {"width": width, "height": 1400}
        page = browser.new_context(offline=True, viewport=viewport, color_scheme=scheme).new_page()
        page.on("console", lambda message: message.type in TALK or complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda request: requests.append(request.url))
        page.goto(path.as_uri())
        yield page
        browser.close()
    assert complaints == []
    assert [url for url in requests if not url.startswith(("data:", "blob:"))] == [path.as_uri()]
