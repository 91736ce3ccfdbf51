"""A headless Chromium, driven by Playwright; tests that ask for it are skipped where one of them is not installed."""

import shutil

import pytest

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


@pytest.fixture(scope="session")
def chromium():
    """The browser, started once for all tests of a process."""
    driver = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed")
    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if path is None:
        pytest.skip("the program chromium is not installed")
    with driver.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture
def page(chromium):
    """A new page of 1280 x 900 pixels; `page.problems` lists errors of the console and requests that leave the machine."""
    context = chromium.new_context(viewport={"width": 1280, "height": 900})
    opened = context.new_page()
    opened.problems = []
    opened.on("console", lambda message: message.type == "error" and opened.problems.append(message.text))
    opened.on("pageerror", lambda error: opened.problems.append(str(error)))
    opened.on("request", lambda request: _leaves(request.url) and opened.problems.append(request.url))
    yield opened
    context.close()


def _leaves(address):
    """Whether a request goes to another machine."""
    return not address.startswith(("file:", "data:", "blob:", "about:", "http://localhost", "http://127.0.0.1"))
