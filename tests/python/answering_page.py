"""A participant at the page of `hapticctl experiment run`, without a browser: begins when asked, touches, answers always the same.

What the page says goes to a file, one line each, for a hand that reads it (hapticd_emulated_rig --instructions FILE).
"""

from __future__ import annotations

import argparse
import http.client
import json
import sys
import time
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("url", help="of the participant's page, as the program prints it")
    parser.add_argument("--instructions", type=Path, required=True, help="what the page says, for the hand")
    parser.add_argument("--answer", default="1")
    parser.add_argument("--touch-s", type=float, default=6.0, help="how long the hand takes to touch; then the space key is pressed")
    options = parser.parse_args()
    place = urlsplit(options.url)

    def key(name: str) -> None:
        connection = http.client.HTTPConnection(place.netloc, timeout=10)
        message = json.dumps({"do": "key", "key": name, "after_ms": 500.0})
        connection.request("POST", f"/act?{place.query}", message, {"X-Hapticd": "1"})
        connection.getresponse().read()

    connection = http.client.HTTPConnection(place.netloc, timeout=600)
    connection.request("GET", f"/events?{place.query}")
    response = connection.getresponse()
    last: Any = None
    while line := response.readline():
        if not line.startswith(b"data: "):
            continue
        state = json.loads(line[6:])
        shown = [state.get(name) for name in ("phase", "text", "interval")]
        if shown == last:
            continue
        last = shown
        print(state["phase"], state.get("text", ""), flush=True)
        with options.instructions.open("a") as file:
            file.write(json.dumps({"instruction": f"page: {state.get('text', '')}"}) + "\n")
        if state["phase"] == "touch":
            time.sleep(options.touch_s)
        if state["phase"] in ("ready", "touch", "rest"):
            key(" ")
        elif state["phase"] in ("question", "rate"):
            key(options.answer)
        elif state["phase"] == "done":
            return 0
    return 1


if __name__ == "__main__":
    sys.exit(main())
