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


@pytest.fixture(scope="session")
def new_page(chromium):
    """Opens a page of 1280 x 900 pixels; its `problems` lists errors of the console and requests that leave the machine."""

    def opened():
        page = chromium.new_context(viewport={"width": 1280, "height": 900}).new_page()
        page.problems = []
        page.on("console", lambda message: message.type == "error" and page.problems.append(message.text))
        page.on("pageerror", lambda error: page.problems.append(str(error)))
        page.on("request", lambda request: _leaves(request.url) and page.problems.append(request.url))
        return page

    return opened


@pytest.fixture
def page(new_page):
    """A page for one test."""
    opened = new_page()
    yield opened
    opened.context.close()


def _leaves(address):
    """Whether a request goes to another machine."""
    return not address.startswith(("file:", "data:", "blob:", "about:", "http://localhost", "http://127.0.0.1"))
