"""The visual page in a browser: with its own hand, and as a client of a daemon on the simulated rig."""

from __future__ import annotations

import functools
import http.server
import subprocess
import threading
from pathlib import Path
from typing import Any, Iterator

import pytest

from console_page import started_browser
from daemon import BINARIES, Daemon

PAGES = Path(__file__).resolve().parents[2] / "client/console/page"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    yield from started_browser(tmp_path_factory.mktemp("profile"), "enable-unsafe-swiftshader", "ignore-gpu-blocklist", size=(1000, 700))


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *words: Any) -> None:
        pass


@pytest.fixture(scope="module")
def files() -> Iterator[str]:
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(PAGES)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/visual.html"
    server.shutdown()


def state(browser: Any) -> dict[str, Any]:
    return dict(browser.execute_script("return window.hapticdVisual"))


def until(browser: Any, condition: str) -> None:
    from selenium.webdriver.support.ui import WebDriverWait

    WebDriverWait(browser, 60).until(lambda b: b.execute_script(f"const s = window.hapticdVisual; return s && ({condition});"))


def complaints(browser: Any) -> list[str]:
    return [line["message"] for line in browser.get_log("browser") if line["level"] == "SEVERE" and "favicon" not in line["message"]]


def colours(browser: Any) -> dict[str, float]:
    """Parts of a picture just drawn, in 1/1000, that show the tool, the halo and the tumour."""
    script = """const done = arguments[0];
      window.hapticdVisual.onDrawn = (canvas) => {
        const copy = document.createElement('canvas');
        copy.width = canvas.width; copy.height = canvas.height;
        const flat = copy.getContext('2d'); flat.drawImage(canvas, 0, 0);
        const p = flat.getImageData(0, 0, copy.width, copy.height).data, n = { blue: 0, orange: 0, red: 0 };
        for (let i = 0; i < p.length; i += 4) {
          if (p[i + 2] > p[i] + 60) n.blue++;
          else if (p[i] > p[i + 2] + 60 && p[i + 1] > p[i + 2] + 35) n.orange++;
          else if (p[i] > p[i + 1] + 90 && p[i] > p[i + 2] + 60) n.red++;
        }
        for (const name in n) n[name] *= 4000 / p.length;
        done(n);
      };"""
    return dict(browser.execute_async_script(script))


def test_shows_tool_error_and_tumour(browser: Any, files: str) -> None:
    browser.get(files + "?source=demo&background=dark")
    until(browser, "s.frames > 5 && s.poses > 5")
    assert state(browser)["stage"] == "live"
    seen = colours(browser)
    assert seen["blue"] > 3 and seen["orange"] > 0.05 and seen["red"] > 0.5, seen
    assert not complaints(browser)


def test_makes_a_registration_error_visible(browser: Any, files: str) -> None:
    browser.get(files + "?source=demo&off=6")
    until(browser, "Number.isFinite(s.missMm) && s.frames > 5")
    # The demonstration's registration is off by (6, -0.8, 0.5) mm; what the hand does meanwhile comes on top.
    assert state(browser)["missMm"] > 4
    assert "off by" in browser.find_element("css selector", ".label.error").text


def test_draws_two_pictures_in_stereo(browser: Any, files: str) -> None:
    browser.get(files + "?source=demo&stereo=1&background=dark&panel=off")
    until(browser, "s.frames > 5 && s.poses > 5")
    labels = browser.execute_script("return [...document.querySelectorAll('.label')].filter((l) => l.textContent === 'tumour').map((l) => parseFloat(l.style.left))")
    assert len(labels) == 2 and labels[0] < 50 < labels[1], labels
    assert not browser.find_element("id", "panel").is_displayed()


def test_a_page_whose_numbers_are_none_stays_as_it_is(browser: Any, files: str) -> None:
    browser.get(files + "?source=demo&predict=x&rate=&phantom=0")
    until(browser, "s.frames > 5 && s.poses > 5")
    assert not complaints(browser)


CLOCK = """
const { PoseClock } = await import('./pose_clock.js');
const clock = new PoseClock();
const OFFSET = 12345.678, DRIFT = 1 + 150e-6;
let outside = 0, last = -Infinity, backwards = 0, seed = 1;
const random = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
for (let i = 0, t = 0; i < 5000; i++, t += 20) {
  const there = 0.05 + (i % 100 === 7 ? 40 : 3) * random(), back = 1 + 8 * random();
  const daemon = (local) => local * DRIFT + OFFSET;
  clock.add(t, t + there + back, daemon(t + there), daemon(t + there));
  const at = t + there + back, shown = clock.toDaemon(at);
  if (shown < last) backwards++;
  last = shown;
  const truth = daemon(at);
  if (truth - at < clock.lower - 1e-9 || truth - at > clock.upper + 1e-9) outside++;
}
return { outside, backwards, bound: clock.boundMs(100000) };
"""


def test_the_clock_keeps_the_truth_within_its_bounds_and_never_runs_back(browser: Any, files: str) -> None:
    browser.get(files + "?source=demo")
    script = f"const done = arguments[0]; (async () => {{ {CLOCK} }})().then(done, (e) => done(String(e)));"
    found = browser.execute_async_script(script)
    assert found["outside"] == 0 and found["backwards"] == 0, found
    assert found["bound"] < 3, found


def test_is_a_client_of_the_daemon(browser: Any, tmp_path: Path) -> None:
    daemon = Daemon(tmp_path, "--model-store", ":memory:", "--scene", "explore_tumour")
    try:
        ctl = [str(BINARIES / "hapticctl"), "--server", daemon.address]
        subprocess.run([*ctl, "sim", "hand", "press", "--force", "2", "--repetitions", "-1"], check=True)
        address = subprocess.run([*ctl, "console", "--print"], check=True, capture_output=True, text=True).stdout.strip()
        browser.get(address)
        browser.get(browser.execute_script("return location.origin") + "/visual?background=dark")
        until(browser, "s.stage === 'live' && s.poses > 10 && s.frames > 5")
        until(browser, "Number.isFinite(s.ageMs) && s.ageMs < 2000")
        assert "not calibrated" in browser.find_element("id", "error").text
        assert "known within" in browser.find_element("id", "clock").text
        # A half-sphere is drawn where one is.
        for name, is_dome in (("sponge_block", False), ("phantom", True), ("none", False)):
            subprocess.run([*ctl, "sim", "object", name], check=True)
            until(browser, f"s.object === '{name}' && s.drawn.includes('tool') && s.drawn.includes('dome') === {str(is_dome).lower()}")
        assert not complaints(browser)
    finally:
        daemon.end()
    until(browser, "s.stage === 'waiting' || s.stage === 'stale'")
