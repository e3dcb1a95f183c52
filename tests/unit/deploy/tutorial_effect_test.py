"""Whether what docs/tutorial_effect.md adds to the sources still fits to them, and compiles.

    python3 tutorial_effect_test.py COMPILER [ARGUMENT ...]    as C++20 sources of the tick are compiled
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
PARTS = ROOT / "tests/unit/rt/contribution"
STEPS = (PARTS / "damper_telemetry.diff", PARTS / "damper_scene.diff")
EFFECT = "rt/contribution/viscous_damper.h"
COMPILER = sys.argv[1:]


def changed_files():
    """Files that the steps change, from the root of the repository."""
    lines = "".join(step.read_text(encoding="utf-8") for step in STEPS).splitlines()
    return [line.removeprefix("--- a/") for line in lines if line.startswith("--- a/")]


class OwnEffect(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.tree = pathlib.Path(folder.name)
        for name in changed_files():
            (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
            if name != EFFECT:
                shutil.copy(ROOT / name, self.tree / name)
        shutil.copy(PARTS / "viscous_damper.h", self.tree / EFFECT)
        for step in STEPS:
            self.run_program(["patch", "--batch", "--fuzz=0", "-p1", "-i", step])

    def run_program(self, command):
        done = subprocess.run(command, cwd=self.tree, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, f"{command[0]}: {done.stdout}{done.stderr}")

    def test_the_steps_fit_to_the_sources_and_compile(self):
        messages = self.tree / "messages"
        messages.mkdir()
        contract = ROOT / "proto"
        names = sorted(path.relative_to(contract) for path in contract.glob("hapticd/v1/*.proto"))
        self.run_program(["protoc", "-I", "proto", "-I", contract, f"--cpp_out={messages}", *names])
        sources = [name for name in changed_files() if name.endswith(".cpp") and "services" not in name]
        self.assertGreaterEqual(len(sources), 4)
        for source in sources:
            self.run_program([*COMPILER, "-fsyntax-only", "-I", ".", "-I", messages, "-I", ROOT, source])


if __name__ == "__main__":
    if not COMPILER:
        sys.exit(__doc__)
    unittest.main(argv=sys.argv[:1])
