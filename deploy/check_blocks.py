#!/usr/bin/env python3
"""Fails when a block of code in a Markdown page is not the file that it says it is.

    python3 deploy/check_blocks.py           every page of the repository
    python3 deploy/check_blocks.py --write   puts the files into the pages

A separate comment in the line before a fenced block names the file, from the root of the repository:

    <!--file: client/cpp/examples/first_client.cpp-->

So what a tutorial prints is what the tests compile and run.

Exit status: 0 all is well, 1 a block differs from its file. Python's own library only.
"""

import argparse
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.dont_write_bytecode = True
from check_links import ROOT, pages_of  # noqa: E402

BLOCK = re.compile(r"^(<!--file: (?P<file>[^\n]*?)-->\n(?P<fence>```+)[a-z+]*\n)(?P<code>.*?)(?P=fence)$", re.S | re.M)
NAMED = re.compile(r"^<!--file: (.*?)-->", re.M)


def check(root, write=False):
    """(how many blocks there are, [what is wrong])"""
    count = 0
    wrong = []
    for page in pages_of(root):
        text = page.read_text(encoding="utf-8")
        where = page.relative_to(root)

        def checked(block):
            nonlocal count
            count += 1
            file = root / block["file"]
            if not file.is_file():
                wrong.append(f"{where}: there is no file {block['file']}")
                return block[0]
            content = file.read_text(encoding="utf-8")
            if content == block["code"]:
                return block[0]
            if not write:
                wrong.append(f"{where}: the block differs from {block['file']}; deploy/check_blocks.py --write")
            return block[1] + content + block["fence"]

        filled = BLOCK.sub(checked, text)
        if len(NAMED.findall(text)) != len(BLOCK.findall(text)):
            wrong.append(f"{where}: a file is named, and no fenced block follows in the next line")
        if write and filled != text:
            page.write_text(filled, encoding="utf-8")
    return count, wrong


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="put the files into the pages")
    parser.add_argument("--root", type=Path, default=ROOT)
    options = parser.parse_args(arguments)
    count, wrong = check(options.root.resolve(), options.write)
    for line in wrong:
        print(f"error: {line}", file=sys.stderr)
    print(f"{count} blocks, {len(wrong)} errors")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
