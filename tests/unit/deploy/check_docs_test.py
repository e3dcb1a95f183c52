"""Whether deploy/check_links.py and deploy/check_blocks.py notice what they are there for; and the README's length."""

import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "deploy"))
sys.dont_write_bytecode = True
import check_blocks  # noqa: E402
import check_links  # noqa: E402

MAX_README_LINES = 150


class Pages(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name).resolve()
        self.write("docs/there.md", "# A page\n\n## What is felt\n\n## Twice\n\n## Twice\n\n## Nothing — felt\n")
        self.write("picture.svg", "<svg/>")

    def write(self, name, text):
        (self.root / name).parent.mkdir(parents=True, exist_ok=True)
        (self.root / name).write_text(text, encoding="utf-8")

    def wrong_links(self, text):
        self.write("README.md", text)
        return check_links.check(self.root)


class Links(Pages):
    def test_links_that_lead_somewhere_are_right(self):
        self.assertEqual(
            self.wrong_links(
                "[a](docs/there.md) [b](docs/there.md#what-is-felt) ![c](picture.svg) [d](https://nowhere.invalid)\n"
                "`[not](a.link)`\n\n```\n[nor](this.one)\n```\n# Here\n[e](#here)\n"
            ),
            [],
        )

    def test_what_is_not_there_is_named_with_its_line(self):
        self.assertEqual(
            self.wrong_links("text\n[a](docs/gone.md)\n"), ["README.md:2: docs/gone.md: there is no such file"]
        )

    def test_a_link_behind_a_code_block_is_seen(self):
        self.assertEqual(len(self.wrong_links("```\ncode\n```\n[a](gone.md)\n")), 1)

    def test_a_link_whose_text_goes_on_in_the_next_line_is_seen(self):
        self.assertEqual(
            self.wrong_links("[a\nlink](docs/gone.md)\n"), ["README.md:2: docs/gone.md: there is no such file"]
        )

    def test_paths_of_the_page_that_lists_them_exist(self):
        self.write("rt/a.h", "")
        self.write("docs/where.md", "`rt/` `rt/a.h` `rt/*.h` `SetTarget`\n`rt/b.h` `rt/a.h/` `rt/*.py`\n")
        self.assertEqual(
            self.wrong_links("text\n"),
            [f"docs/where.md:2: {path}: there is no such path" for path in ("rt/b.h", "rt/a.h/", "rt/*.py")],
        )

    def test_a_folder_is_no_page(self):
        self.assertIn("names a folder", self.wrong_links("[a](docs)\n")[0])

    def test_outside_the_repository_there_is_nothing(self):
        self.assertIn("leads out of the repository", self.wrong_links("[a](../other.md)\n")[0])

    def test_anchors_are_headings(self):
        for anchor in ("not-there", "twice", "nothing--felt", "nothing-felt"):
            with self.subTest(anchor):
                self.assertIn("no heading", self.wrong_links(f"[a](docs/there.md#{anchor})\n")[0])

    def test_built_folders_are_not_looked_at(self):
        self.write("build/docs/page.md", "[a](gone.md)\n")
        self.write(".hidden/page.md", "[a](gone.md)\n")
        self.assertEqual(self.wrong_links(""), [])

    def test_what_is_linked_and_no_page_is_listed(self):
        self.write("README.md", "![c](picture.svg) [a](docs/there.md)\n")
        self.assertEqual(check_links.targets(self.root), [Path("picture.svg")])


class Blocks(Pages):
    PAGE = "# Page\n\n<!--file: code.cpp-->\n```cpp\nint a;\n```\nmore\n"

    def test_a_block_that_is_its_file_is_right(self):
        self.write("code.cpp", "int a;\n")
        self.write("README.md", self.PAGE)
        self.assertEqual(check_blocks.check(self.root), (1, []))

    def test_a_block_that_differs_is_named_and_written(self):
        self.write("code.cpp", "int b;\n")
        self.write("README.md", self.PAGE)
        self.assertIn("README.md: the block differs from code.cpp", check_blocks.check(self.root)[1][0])
        self.assertEqual(check_blocks.check(self.root, write=True), (1, []))
        self.assertEqual((self.root / "README.md").read_text(), self.PAGE.replace("int a;", "int b;"))
        self.assertEqual(check_blocks.check(self.root), (1, []))

    def test_a_comment_within_a_line_is_text(self):
        self.write("README.md", "Write `<!--file: code.cpp-->` before a block.\n")
        self.assertEqual(check_blocks.check(self.root), (0, []))

    def test_a_file_that_is_gone_and_a_block_that_is_missing_are_errors(self):
        self.write("README.md", self.PAGE)
        self.assertIn("there is no file code.cpp", check_blocks.check(self.root)[1][0])
        self.write("README.md", "<!--file: code.cpp-->\n\ntext\n")
        self.assertIn("no fenced block follows", check_blocks.check(self.root)[1][0])


class ThisRepository(unittest.TestCase):
    def test_every_link_leads_somewhere(self):
        self.assertEqual(check_links.check(check_links.ROOT), [])

    def test_every_block_is_its_file(self):
        count, wrong = check_blocks.check(check_links.ROOT)
        self.assertEqual(wrong, [])
        self.assertGreater(count, 0)

    def test_the_readme_is_short(self):
        lines = (check_links.ROOT / "README.md").read_text(encoding="utf-8").splitlines()
        self.assertLessEqual(len(lines), MAX_README_LINES)


if __name__ == "__main__":
    unittest.main()
