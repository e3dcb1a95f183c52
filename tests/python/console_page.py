"""The console in a headless browser, and without one."""

from __future__ import annotations

import http.client
import json
import shutil
import time
from pathlib import Path
from typing import Any, Callable, Iterator
from urllib.parse import urlsplit

import pytest

import hapticd

PATIENCE_S = 60.0
HEADERS = {"Content-Type": "application/json", "X-Hapticd": "1"}


def configuration(folder: Path, more: str = "") -> tuple[str, ...]:
    """Options of a daemon that a console can speak to, with recordings in `folder`."""
    path = folder / "rig.toml"
    path.write_text(f'[recording]\nfolder = "{folder / "recordings"}"\nkeep_free_mb = 0.0\n{more}')
    (folder / "recordings").mkdir(exist_ok=True)
    return ("--config", str(path), "--unix", str(folder / "d.sock"))


class Visitor:
    """A browser's requests, without a browser."""

    def __init__(self, daemon: Any, console: Any, sign_in: bool = True) -> None:
        self.port = console.port
        self.cookie = ""
        if sign_in:
            with hapticd.connect(daemon.address) as rig:
                place = urlsplit(rig.open_console().url)
            answer = self.ask("GET", f"{place.path}?{place.query}")
            assert answer.status == 200
            self.cookie = answer.headers["Set-Cookie"].split(";")[0]

    def ask(self, method: str, path: str, body: str = "", headers: dict[str, str] = {}) -> http.client.HTTPResponse:  # noqa: B006
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        own = {"Cookie": self.cookie} if self.cookie else {}
        connection.request(method, path, body or None, {**own, **headers})
        return connection.getresponse()

    def rpc(self, method: str, request: Any = {}, headers: dict[str, str] = HEADERS) -> tuple[int, Any]:  # noqa: B006
        answer = self.ask("POST", f"/rpc/hapticd.v1.{method}", json.dumps(request), headers)
        return answer.status, json.loads(answer.read() or b"{}")


#: From now on window.asked() is how many calls are under way.
COUNT_CALLS = """
    let under_way = 0;
    const ask = window.fetch;
    window.fetch = async (...request) => {
      ++under_way;
      try {
        const answer = await ask(...request);
        await answer.clone().arrayBuffer();
        return answer;
      } finally {
        setTimeout(() => --under_way);  // after the page has taken the answer
      }
    };
    window.asked = () => under_way;"""


class Page:
    """The page, as a person uses it: by labels."""

    def __init__(self, driver: Any) -> None:
        self.driver = driver

    def open(self, url: str) -> None:
        self.driver.get(url)
        self.run(COUNT_CALLS)
        self.wait(lambda: not self.shows("body.away") and self.text("#rig") not in ("", "…"))

    def wait(self, condition: Callable[[], Any], seconds: float = PATIENCE_S, every: float = 0.05) -> Any:
        from selenium.common.exceptions import NoSuchElementException, StaleElementReferenceException

        until = time.monotonic() + seconds
        while time.monotonic() < until:
            try:
                if value := condition():
                    return value
            except (NoSuchElementException, StaleElementReferenceException):
                pass
            time.sleep(every)
        raise AssertionError(self.driver.find_element("tag name", "body").text)

    def shows(self, selector: str) -> bool:
        return bool(self.driver.find_elements("css selector", selector))

    def text(self, selector: str = "main") -> str:
        return str(self.driver.find_element("css selector", selector).text)

    def settle(self) -> None:
        """Waits until what the page asked for has come, and is drawn in its last colours."""
        self.wait(lambda: self.run("return window.asked()") == 0)
        self.driver.execute_async_script("const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done));")
        self.wait(lambda: self.run("return !document.getAnimations().some((one) => one instanceof CSSTransition)"))

    def says(self, text: str, selector: str = "main") -> None:
        self.wait(lambda: text in self.text(selector))

    def view(self, name: str) -> None:
        self.driver.find_element("css selector", f"nav a[data-view={name}]").click()
        self.wait(lambda: self.shows(f".view.{name}"))

    def click(self, label: str, selector: str = "main") -> None:
        def press() -> bool:
            for button in self.driver.find_elements("css selector", f"{selector} button"):
                if button.text == label and button.is_enabled():
                    button.click()
                    return True
            return False

        self.wait(press)

    def choose(self, label: str, value: str) -> None:
        from selenium.webdriver.support.ui import Select

        self.wait(lambda: [o for o in self.field(label).find_elements("tag name", "option") if o.text.startswith(value)])
        select = Select(self.field(label))
        texts = [option.text for option in select.options]
        select.select_by_visible_text(value if value in texts else next(text for text in texts if text.startswith(value)))

    def field(self, label: str) -> Any:
        return self.driver.find_element("css selector", f"[aria-label='{label}']")

    def enter(self, label: str, text: str) -> None:
        self.driver.execute_script(
            "const [f, t] = arguments; f.value = t; f.dispatchEvent(new Event('input', {bubbles: true})); "
            "f.dispatchEvent(new Event('change', {bubbles: true}));", self.field(label), text)  # fmt: skip

    def run(self, script: str, *arguments: Any) -> Any:
        return self.driver.execute_script(script, *arguments)

    def problems(self) -> list[str]:
        """Errors of the page itself: a call that the daemon refuses is none."""
        return [
            entry["message"] for entry in self.driver.get_log("browser")
            if entry["level"] == "SEVERE" and "status of 4" not in entry["message"] and "ERR_CONNECTION_REFUSED" not in entry["message"]
            and "WebSocket" not in entry["message"] and "ERR_EMPTY_RESPONSE" not in entry["message"] and "ERR_CONNECTION_RESET" not in entry["message"]
        ]  # fmt: skip


SIZE = (1440, 900)


def start_browser(profile: Path, *flags: str, size: tuple[int, int] = SIZE) -> Any:
    """Chromium without a window."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    for flag in ("headless=new", "no-sandbox", "disable-dev-shm-usage", f"window-size={size[0]},{size[1]}", f"user-data-dir={profile}", *flags):
        options.add_argument("--" + flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))
    driver.set_script_timeout(PATIENCE_S)
    return driver


def started_browser(profile: Path, *flags: str, size: tuple[int, int] = SIZE) -> Iterator[Any]:
    """The browser, to its end; the test is skipped if it is not installed."""
    if not shutil.which("chromium"):
        pytest.skip("chromium is not installed")
    driver = start_browser(profile, *flags, size=size)
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    yield from started_browser(tmp_path_factory.mktemp("profile"), "disable-gpu")


@pytest.fixture
def page(browser: Any) -> Iterator[Page]:
    """The one browser of the module, without what a test before left in it."""
    browser.get_log("browser")
    yield Page(browser)
    browser.get("about:blank")  # asks nothing more of a daemon that ends
    browser.execute_cdp_cmd("Network.clearBrowserCookies", {})  # they would be shown to the console on any port
    browser.set_window_size(*SIZE)
