"""Whether deploy/check_sentences.py notices what is hard to read, and functions that are gone; and that here are none."""

import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "deploy"))
sys.dont_write_bytecode = True
import check_sentences  # noqa: E402


class Sentences(unittest.TestCase):
    def found(self, files, *paths):
        """(place, pattern) of each problem in the files: path → text."""
        with tempfile.TemporaryDirectory() as folder:
            for name, text in files.items():
                (Path(folder) / name).parent.mkdir(parents=True, exist_ok=True)
                (Path(folder) / name).write_text(text, encoding="utf-8")
            return [(place, pattern) for place, pattern, _ in check_sentences.check(Path(folder), paths)]

    def patterns_of(self, sentence):
        return [pattern for _, pattern in self.found({"docs/a.md": sentence + "\n"})]

    def test_a_doc_comment_starts_with_a_noun_or_a_verb(self):
        text = "/// They do.\nint a;\n\n/// The same.\nint b;\n\n/// Rate, Hz.\nint c;  ///< It.\n// These do.\nint d;\n"
        self.assertEqual(
            self.found({"rt/a.h": text}), [("rt/a.h:1", "opener"), ("rt/a.h:4", "opener"), ("rt/a.h:8", "opener")]
        )
        self.assertEqual(self.found({"proto/a.proto": "// As above.\nint32 a = 1;\n"}), [("proto/a.proto:1", "opener")])
        self.assertEqual(self.found({"a.py": 'def f():\n    """As g()."""\n'}), [("a.py:2", "opener")])

    def test_a_fragment_that_begins_with_of_is_found_in_any_comment(self):
        self.assertEqual(self.found({"a.cpp": "int a;\n// Of the rig.\n"}), [("a.cpp:2", "Of")])
        self.assertEqual(self.patterns_of("It is so. Of a drive nothing is known."), ["Of"])
        self.assertEqual(self.patterns_of("There are three. Of the three one is plain."), [])

    def test_what_is_not_a_thing_is_not_no_thing(self):
        self.assertEqual(self.patterns_of("A pose is no number."), ["is no X"])
        self.assertEqual(self.patterns_of("There is no pose, and it is no longer needed."), [])

    def test_where_is_a_place(self):
        self.assertEqual(self.patterns_of("Where a tool is heavy, it sinks."), ["Where"])
        self.assertEqual(self.patterns_of("Empty where it has none."), ["Where"])
        self.assertEqual(self.patterns_of("The point where the axes meet."), [])

    def test_the_other_patterns(self):
        self.assertEqual(self.patterns_of("It has a thread of its own."), ["of its own"])
        self.assertEqual(self.patterns_of("The table stands still."), ["stands"])
        self.assertEqual(self.patterns_of("D stands for the dissertation."), [])
        self.assertEqual(self.patterns_of("Then no one reads it."), ["no one"])
        self.assertEqual(self.patterns_of("Who connects is counted."), ["who"])
        self.assertEqual(self.patterns_of("Who connects?"), [])

    def test_the_line_is_the_one_of_the_words(self):
        self.assertEqual(self.found({"a.cpp": "// Reads\n// while no\n// one looks.\n"}), [("a.cpp:2", "no one")])

    def test_code_and_quoted_text_are_not_read(self):
        text = 'const char* a = "// no one";\nconst char* b = R"(// no one)";\n// The text "no one" and `no one`.\n'
        self.assertEqual(self.found({"a.cpp": text}), [])
        self.assertEqual(self.found({"docs/a.md": "# Where it is, and why\n\n```\nno one\n```\n"}), [])

    def test_lines_of_a_readme_are_short(self):
        text = "x" * 121 + "\n"
        self.assertEqual(self.found({"a/README.md": text, "docs/b.md": text}), [("a/README.md:1", "long line")])

    def test_a_comment_names_functions_that_are_there(self):
        code = "/// Calls open() and Rig::close(), not shut() or Rig::open().\nclass Rig { void close(); };\n"
        files = {"a.h": code, "b.h": "void open();\n"}
        self.assertEqual(self.found(files), [("a.h:1", "gone"), ("a.h:1", "gone")])
        self.assertEqual(self.found(files, "a.h"), [], "a part of the project names functions of the rest")

    def test_the_project_itself(self):
        found = check_sentences.check(ROOT)
        self.assertEqual([": ".join(problem) for problem in found], [])


if __name__ == "__main__":
    unittest.main()
