"""Whether deploy/check_arrows.py notices cycles, forbidden includes, crowded folders, long files and readers of records; and that here are none."""

import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "deploy"))
sys.dont_write_bytecode = True
import check_arrows  # noqa: E402


class Arrows(unittest.TestCase):
    def problems(self, files):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            for name, included in files.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text("".join(f'#include "{i}"\n' for i in included), encoding="utf-8")
            arrows, count, _ = check_arrows.read_graph(root)
            return list(check_arrows.problems(arrows, count))

    def test_includes_down_the_layers_are_right(self):
        self.assertEqual(
            self.problems({"server/a/a.h": ["rt/b/b.h"], "rt/b/b.h": ["hal/c.h"], "hal/c.h": ["elsewhere.h"]}), []
        )

    def test_a_cycle_is_named_with_its_includes(self):
        found = self.problems(
            {"server/a/a.h": ["server/b/b.h"], "server/b/b.h": ["server/c/c.h"], "server/c/c.h": ["server/a/a.h"]}
        )
        self.assertIn("a cycle between server/a, server/b, server/c", found[0])
        self.assertEqual(len(found), 4)

    def test_an_include_against_the_layers_is_named(self):
        found = self.problems({"rt/signal/a.h": ["rt/scene/b.h"], "rt/scene/b.h": []})
        self.assertEqual(
            found, ["rt/signal/a.h includes rt/scene/b.h: rt/signal must not include from rt/scene"]
        )

    def test_what_all_may_include_from_includes_nothing(self):
        self.assertEqual(self.problems({"client/a.h": ["hal/lock/mutex.h"], "hal/lock/mutex.h": []}), [])
        found = self.problems({"hal/lock/mutex.h": ["hal/b.h"], "hal/b.h": []})
        self.assertEqual(found, ["hal/lock/mutex.h includes hal/b.h: hal/lock must not include from hal"])

    def test_a_crowded_folder_is_named(self):
        found = self.problems({f"hal/x/{i}.h": [] for i in range(check_arrows.MAX_FILES + 1)})
        self.assertEqual(len(found), 1)
        self.assertIn("hal/x has 27 files", found[0])

    def test_a_long_file_is_named_unless_it_has_a_reason(self):
        lines = {"hal/a.cpp": 401, "rt/b.cpp": 400, "tests/c.cpp": 900, "server/d.cpp": 500}
        found = list(check_arrows.long_files(lines, {"server/d.cpp": "one table"}))
        self.assertEqual(len(found), 1)
        self.assertIn("hal/a.cpp has 401 lines", found[0])
        self.assertIn("rt/b.cpp is listed as long", list(check_arrows.long_files(lines, {"rt/b.cpp": "why"}))[-1])

    def test_what_writes_to_the_terminal_past_the_printer_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            (root / "client/cli/session").mkdir(parents=True)
            (root / "client/cli/session/print.cpp").write_text('fmt::print("{}", line);\n')
            (root / "client/cli/a.cpp").write_text('// fmt::print(x)\nfmt::print("{}\\n", note);\nstd::cout << note;\n')
            found = list(check_arrows.raw_output(root))
        self.assertEqual([line.split(" ")[0] for line in found], ["client/cli/a.cpp:2", "client/cli/a.cpp:3"])

    def test_what_includes_a_library_without_its_guards_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            for name in ("proto/text/toml_library.h", "client/cli/a.cpp"):
                (root / name).parent.mkdir(parents=True)
                (root / name).write_text("#include <map>\n#include <toml++/toml.h>\n")
            found = list(check_arrows.unguarded_includes(root))
        self.assertEqual(found, ["client/cli/a.cpp includes toml++/toml.h: include proto/text/toml_library.h"])

    def test_what_reads_a_record_in_a_tick_is_named(self):
        filler = "void A::fill_record(const State& now,\n    TickRecord& record) const noexcept {\n"
        files = {
            "rt/a/right.cpp": filler + "  record.zero.force_n = now.n;\n  record.channels |= kA;\n}  // TickRecord\n",
            "rt/a/unnamed.h": "virtual void fill_record(TickRecord& /*record*/) const noexcept {}\n",
            "rt/loop/ring.h": "const TickRecord& latest();\n",
            "rt/b/not_const.h": "void fill_record(TickRecord& record) noexcept;\n",
            "rt/b/takes.h": "double update(TickRecord& record) noexcept;\n",
            "rt/b/takes_const.h": "void update(const TickRecord& record) const noexcept;\n",
            "rt/b/keeps.h": "TickRecord last_;\n",
            "rt/b/reads.cpp": filler + "  record.a = record.b.c;\n  if (record.d == 1) return;\n}\n",
            "rt/b/mutable.h": "mutable int kept_;\n",
        }
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            for name, text in files.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text)
            found = list(check_arrows.record_readers(root))
        self.assertEqual(
            [" ".join(line.split(" ")[:3]) for line in found],
            ["rt/b/keeps.h takes a", "rt/b/mutable.h has something", "rt/b/not_const.h takes a",
             "rt/b/reads.cpp reads record.b.c:", "rt/b/reads.cpp reads record.d:", "rt/b/takes.h takes a",
             "rt/b/takes_const.h takes a"],
        )

    def test_the_project_itself(self):
        arrows, count, lines = check_arrows.read_graph(ROOT)
        self.assertEqual(list(check_arrows.problems(arrows, count)) + list(check_arrows.long_files(lines)), [])
        self.assertEqual(list(check_arrows.raw_output(ROOT)) + list(check_arrows.record_readers(ROOT)), [])
        self.assertEqual(list(check_arrows.unguarded_includes(ROOT)), [])
        self.assertGreater(len(count), 50)


if __name__ == "__main__":
    unittest.main()
