"""A page in headless Chromium, without a network: its contents, its requests, and the messages of its console."""

import contextlib
import shutil

import pytest

CHROMIUM = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
TALK = ("log", "info", "debug")


@pytest.fixture(scope="module")
def opened():
    """Open a file in a page of the browser of a module; check at the end that it made no request and no error."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="no playwright to drive a browser"
    )
    with playwright.sync_playwright() as driver:
        # the browser of playwright's own list, or of the system
        programs = filter(None, map(shutil.which, (driver.chromium.executable_path, *CHROMIUM)))
        program = next(programs, None)
        if program is None:
            pytest.skip(
                "no Chromium to open pages in: playwright install chromium, or apt-get install chromium"
            )
        browser = driver.chromium.launch(executable_path=program, args=["--no-sandbox"])

        @contextlib.contextmanager
        def open_file(path, *, width=1150, dark=False):
            complaints, requests = [], []
            viewport = {"width": width, "height": 1400}
            context = browser.new_context(
                offline=True, viewport=viewport, color_scheme="dark" if dark else "light"
            )
            page = context.new_page()
            page.on(
                "console", lambda message: message.type in TALK or complaints.append(message.text)
            )
            page.on("pageerror", lambda error: complaints.append(str(error)))
            page.on("request", lambda request: requests.append(request.url))
            page.goto(path.as_uri())
            yield page
            context.close()
            assert complaints == []
            assert [url for url in requests if not url.startswith(("data:", "blob:"))] == [
                path.as_uri()
            ]

        yield open_file
        browser.close()
