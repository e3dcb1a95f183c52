#!/usr/bin/env python3
""".ci/run ends what it has begun in the background, with all that this has started."""
import os
import pathlib
import subprocess
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
#: In place of its parts: a build in the background, whose child says its number, and a part that fails.
PARTS = """
build() { sleep 1000 & echo $! >"$child"; wait; }
child=$1
in_background build build
part "one that fails" bash -c 'until [[ -s $0 ]]; do sleep 0.01; done; exit 3' "$child"
"""


class CiRun(unittest.TestCase):
    def test_a_failure_leaves_nothing_running(self):
        text = (ROOT / ".ci/run").read_text()
        machinery = text[: text.index('\npart "')]
        with tempfile.TemporaryDirectory() as folder:
            place = pathlib.Path(folder)
            (place / ".ci").mkdir()
            (place / ".ci/run").write_text(machinery + PARTS)
            ran = subprocess.run(["bash", place / ".ci/run", place / "child"], capture_output=True, text=True, timeout=50)
            self.assertEqual(ran.returncode, 3, ran.stderr)
            self.assertIn("FAILED at: one that fails", ran.stdout)
            child = int((place / "child").read_text())
        until = time.monotonic() + 30
        while time.monotonic() < until:
            try:
                os.kill(child, 0)
            except ProcessLookupError:
                return
            time.sleep(0.05)
        os.kill(child, 9)
        self.fail("it still runs")


if __name__ == "__main__":
    unittest.main()
