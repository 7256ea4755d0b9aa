"""A browser for the tests of pages."""

import os
import shutil

import pytest

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
OPTIONS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)

DESK = {"width": 1400, "height": 900}


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip("playwright.sync_api")
    if CHROMIUM is None:
        pytest.skip("there is no chromium")
    with playwright.sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        yield chromium
        chromium.close()


@pytest.fixture
def open_page(browser):
    """Opens a page in a window of its own; what it says or asks for beside itself and its pictures fails the test."""
    contexts, said = [], []

    def open_page(path, at="", *, ready=True, **options):
        context = browser.new_context(**{"viewport": DESK, **options})
        contexts.append(context)
        view, url = context.new_page(), path.as_uri()

        def note_request(request):
            picture = request.resource_type == "image" and request.url.startswith("file:")
            if request.url.partition("#")[0] != url and not picture:
                said.append(request.url)

        view.on("request", note_request)
        view.on("console", lambda message: said.append(message.text))
        view.on("pageerror", lambda error: said.append(str(error)))
        view.on("dialog", lambda dialog: said.append(dialog.message))
        view.goto(url + at)
        if ready:
            view.wait_for_selector("html[data-ready]")
        return view

    yield open_page
    for context in contexts:
        context.close()
    assert said == []
