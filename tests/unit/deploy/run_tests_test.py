#!/usr/bin/env python3
"""deploy/run_tests.sh counts and names the tests that passed only when they were run again alone, with a ctest that only speaks."""
import os
import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
# Prints FOLDER/N.out at its N-th call and ends with the code of FOLDER/N.code; keeps its arguments.
FAKE = """#!/usr/bin/env bash
echo "$*" >>"{folder}/calls"
n=$(wc -l <"{folder}/calls")
cat "{folder}/$n.out"
exit "$(cat "{folder}/$n.code")"
"""


def output(tests, failed, labels=""):
    """What ctest prints at its end, with the failed tests and why."""
    lines = [f"{100 * (tests - len(failed)) // tests}% tests passed, {len(failed)} tests failed out of {tests}", labels,
             "Total Test time (real) =  12.34 sec", ""]
    if failed:
        lines += ["The following tests FAILED:"] + [f"\t{number:5} - {name}" for number, name in enumerate(failed, 17)]
        lines += ["Errors while running CTest"]
    return "\n".join(lines) + "\n"


class RunTests(unittest.TestCase):
    def run_with(self, *runs, options=()):
        """The code, the lines that were printed and the arguments of each call; runs: (output, code of ctest)."""
        with tempfile.TemporaryDirectory() as folder:
            place = pathlib.Path(folder)
            for number, (text, code) in enumerate(runs, 1):
                (place / f"{number}.out").write_text(text)
                (place / f"{number}.code").write_text(str(code))
            (place / "ctest").write_text(FAKE.format(folder=folder))
            (place / "ctest").chmod(0o755)
            environment = {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"}
            done = subprocess.run(["bash", ROOT / "deploy/run_tests.sh", "release", *options], env=environment,
                                  capture_output=True, text=True, timeout=50)
            return done.returncode, done.stdout.splitlines(), (place / "calls").read_text().splitlines()

    def test_without_failures_it_runs_once(self):
        code, lines, calls = self.run_with((output(2305, []), 0), options=("-LE", "live"))
        self.assertEqual((code, lines[-1]), (0, "run_tests.sh: 2305 passed, 0 failed"))
        self.assertIn("100% tests passed, 0 tests failed out of 2305", lines)
        self.assertEqual(len(calls), 1)
        self.assertRegex(calls[0], r"^--preset release -j[0-9]+ -LE live$")

    def test_those_that_pass_only_alone_are_counted_and_named(self):
        first = output(2305, ["A.B (Failed)", "C/D.E/3  # GetParam() = (1, 2) (Timeout)  live"])
        code, lines, calls = self.run_with((first, 8), (output(2, []), 0))
        self.assertEqual(code, 0)
        self.assertEqual(lines[-1], "run_tests.sh: 2305 passed, 0 failed; 2 passed only when run again alone: A.B, C/D.E/3")
        self.assertEqual(lines[-2], "100% tests passed, 0 tests failed out of 2305")
        self.assertEqual(calls[1:], [r"--preset release -R ^(A\.B|C/D\.E/3)( |$) -j1"])

    def test_what_is_not_run_again_has_not_passed(self):
        first = output(9, ["A.B (Failed)", "C.D (Failed)"])
        code, lines, _ = self.run_with((first, 8), (output(1, []), 0))
        self.assertEqual((code, lines[-1]), (1, "run_tests.sh: only 1 of the failed tests were found to be run again"))

    def test_too_many_of_them_are_a_failure(self):
        first = output(9, ["A.B (Failed)", "C.D (SEGFAULT)", "Python.client (Failed)"])
        code, lines, _ = self.run_with((first, 8), (output(3, []), 0))
        self.assertEqual(code, 1)
        self.assertEqual(lines[-1], "run_tests.sh: 9 passed, 0 failed; 3 passed only when run again alone: "
                                    "A.B, C.D, Python.client; more than 2 of these are a failure")

    def test_what_fails_twice_has_failed(self):
        first = output(9, ["A.B (Failed)", "A.Bc (Failed)"])
        code, lines, _ = self.run_with((first, 8), (output(2, ["A.B (Failed)"]), 8))
        self.assertEqual(code, 1)
        self.assertEqual(lines[-1], "run_tests.sh: 8 passed, 1 failed (A.B); 1 passed only when run again alone: A.Bc")

    def test_a_ctest_that_says_nothing_of_tests_is_a_failure(self):
        code, lines, calls = self.run_with(("No such test preset\n", 3))
        self.assertEqual((code, len(calls)), (3, 1))
        self.assertEqual(lines, ["No such test preset"])
        code, lines, _ = self.run_with((output(9, ["A.B (Failed)"]), 8), ("terminated\n", 143))
        self.assertEqual((code, lines[-1]), (143, "terminated"))


if __name__ == "__main__":
    unittest.main()
