"""What a part of the study leaves for the report: figures, tables and plots, in the form of the other studies."""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import Any, Mapping, Optional, Sequence

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[2] / "python"))


def options(about: Optional[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--quick", action="store_true", help="fewer cases, the same figures")
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    return chosen


class Output:
    """A folder with figures.jsonl and a section."""

    def __init__(self, folder: Path, name: str, title: str) -> None:
        self._folder = folder
        self._figures = folder / "figures.jsonl"
        self._figures.write_text("")
        (folder / "sections").mkdir(exist_ok=True)
        self._section = folder / "sections" / f"{name}.jsonl"
        self._section.write_text("")
        self._say({"kind": "section", "name": name, "title": title})

    def _say(self, item: Mapping[str, Any]) -> None:
        with self._section.open("a") as file:
            file.write(json.dumps(item, ensure_ascii=False) + "\n")

    def figure(
        self, name: str, value: float, conditions: Mapping[str, Any] = {}, *, unit: str = "1", goal: Optional[float] = None,
        reference: Optional[float] = None, source: str = "", failed: str = "",
    ) -> None:  # fmt: skip
        """Record as figure_writer.h has it: a missing value needs a reason."""
        record = {
            "figure": name, "case": dict(conditions), "value": None, "unit": unit, "goal": goal, "reference": reference,
            "source": source or None,
        }  # fmt: skip
        if failed or not math.isfinite(value):
            record["failed"] = failed or "the value is not finite"
        else:
            record["value"] = value
        with self._figures.open("a") as file:
            file.write(json.dumps(record, ensure_ascii=False) + "\n")

    def text(self, text: str) -> None:
        print(text, flush=True)
        self._say({"kind": "text", "text": text})

    def table(self, title: str, headers: Sequence[str], rows: Sequence[Sequence[str]], remark: str = "") -> None:
        print(title, *("  ".join(row) for row in [headers, *rows]), sep="\n", flush=True)
        self._say({"kind": "table", "title": title, "remark": remark, "headers": list(headers), "rows": [list(row) for row in rows]})

    def plot(self, name: str, title: str, figure: Any) -> None:
        figure.savefig(self._folder / f"{name}.svg")
        self._say({"kind": "plot", "name": name, "title": title, "missing": ""})
