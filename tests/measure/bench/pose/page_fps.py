#!/usr/bin/env python3
"""Pictures a second of the visual page in headless Chromium, with a hand that palpates the scene with a tumour.

    /usr/bin/python3 page_fps.py --hapticd PATH --hapticctl PATH --out FILE [--seconds S] [--pictures FOLDER]

Writes [{"page", "fps", "work_ms", "drawn_by"}] for the page over a camera's picture, over nothing, and in stereo. Without a graphics
card Chromium draws with the processor, which `drawn_by` says; then the figure is of the processor.
"""

from __future__ import annotations

import argparse
import json
import re
import signal
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

PAGES = {"camera": "", "see-through": "background=clear", "stereo": "stereo=1&background=clear"}


def started(hapticd: str, folder: Path) -> tuple[subprocess.Popen[bytes], str]:
    log = folder / "hapticd.log"
    with log.open("wb") as output:
        process = subprocess.Popen(
            [hapticd, "--rig", "sim", "--scene", "explore_tumour", "--listen", "127.0.0.1:0"],
            stdout=output, stderr=output)  # fmt: skip
    until = time.monotonic() + 60
    while time.monotonic() < until and process.poll() is None:
        found = re.search(r"listens on (\S+)", log.read_text())
        if found:
            return process, found.group(1)
        time.sleep(0.05)
    raise RuntimeError(log.read_text())


def browser_in(folder: Path) -> Any:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    for flag in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--window-size=1280,800", "--ignore-gpu-blocklist",
                 "--enable-unsafe-swiftshader", f"--user-data-dir={folder / 'profile'}"):  # fmt: skip
        options.add_argument(flag)
    return webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))


def drawn_by(browser: Any) -> str:
    script = """const gl = document.createElement('canvas').getContext('webgl');
        const info = gl && gl.getExtension('WEBGL_debug_renderer_info');
        return info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : 'unknown';"""
    name = str(browser.execute_script(script))
    return "processor" if re.search("swiftshader|llvmpipe|softpipe", name, re.I) else name


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hapticd", required=True)
    parser.add_argument("--hapticctl", required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--pictures", type=Path)
    wanted = parser.parse_args()
    figures = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        daemon, address = started(wanted.hapticd, folder)
        browser = None
        try:
            def ctl(*words: str) -> str:
                return subprocess.run([wanted.hapticctl, "--server", address, *words], check=True, capture_output=True, text=True).stdout

            ctl("sim", "hand", "press", "--force", "2", "--repetitions", "-1")
            browser = browser_in(folder)
            browser.get(ctl("console", "--print").strip())
            origin = browser.execute_script("return location.origin")
            for page, query in PAGES.items():
                browser.get(f"{origin}/visual?{query}")
                time.sleep(4)  # the first seconds compile shaders
                before, from_s = browser.execute_script("return window.hapticdVisual.frames"), time.monotonic()
                time.sleep(wanted.seconds)
                state = browser.execute_script("return window.hapticdVisual")
                fps = (state["frames"] - before) / (time.monotonic() - from_s)
                figures.append({"page": page, "fps": fps, "work_ms": state["workMs"], "drawn_by": drawn_by(browser), "stage": state["stage"]})
                if wanted.pictures:
                    browser.save_screenshot(str(wanted.pictures / f"visual_{page}.png"))
        finally:
            if browser:
                browser.quit()
            daemon.send_signal(signal.SIGTERM)
            daemon.wait()
    wanted.out.write_text(json.dumps(figures))


main()
