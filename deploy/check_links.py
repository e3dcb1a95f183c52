#!/usr/bin/env python3
"""Fails when a link in a Markdown page, or a path in docs/where.md, leads nowhere. Uses no network: links to other sites are not followed.

    python3 deploy/check_links.py             every page of the repository
    python3 deploy/check_links.py --targets   prints what the pages link to that is not a page (pictures, sources)

A relative link names a file of the repository, never a folder: only a file has a page when the documentation is built
as HTML. An anchor is the heading as GitHub and as mkdocs spell it, so both must agree, and the heading is there once in
its page.

Exit status: 0 all is well, 1 a link is wrong. Python's own library only.
"""

import argparse
import re
import sys
import unicodedata
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parent.parent
SKIPPED = {"build", "out", "third_party"}
# Pages whose `quoted/paths` are paths of the repository: files, folders with a / at the end, or patterns with *.
PAGES_OF_PATHS = ("docs/where.md",)

LINK = re.compile(r"!?\[(?:[^\]\n]|\n(?!\n))*\]\(([^()\s]+(?:\([^()\s]*\))?)\)")
ELSEWHERE = re.compile(r"[a-z][a-z0-9+.-]*:|//")
HEADING = re.compile(r"#{1,6}\s+(.+?)\s*#*$")


def pages_of(root):
    """Every Markdown page below `root`, but for built and hidden folders."""
    found = []
    for path in sorted(root.rglob("*.md")):
        folders = path.relative_to(root).parts[:-1]
        if not any(folder in SKIPPED or folder.startswith(".") for folder in folders):
            found.append(path)
    return found


def prose_lines(text):
    """[(line number, line)] outside code blocks, code in a line taken out."""
    lines = []
    fence = None
    for number, line in enumerate(text.splitlines(), 1):
        mark = re.match(r"\s*(```+|~~~+)", line)
        if mark:
            if fence is None:
                fence = mark[1]
            elif mark[1].startswith(fence):
                fence = None
            continue
        if fence is None:
            lines.append((number, re.sub(r"`[^`]*`", "", line)))
    return lines


def github_anchor(heading):
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def mkdocs_anchor(heading):
    ascii_only = unicodedata.normalize("NFKD", heading).encode("ascii", "ignore").decode()
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", ascii_only).strip().lower())


def anchors_of(text):
    """The anchors that hold wherever the page is read: {anchor}."""
    headings = []
    fence = False
    for line in text.splitlines():
        if re.match(r"\s*(```|~~~)", line):
            fence = not fence
        found = None if fence else HEADING.match(line)
        if found:
            headings.append(re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", found[1]))
    anchors = [github_anchor(heading) for heading in headings]
    return {
        anchor
        for anchor, heading in zip(anchors, headings)
        if anchor == mkdocs_anchor(heading) and anchors.count(anchor) == 1
    }


def links_of(page):
    """[(line number, target)] of the relative links of a page; their texts may go on in the next line."""
    lines = prose_lines(page.read_text(encoding="utf-8"))
    prose = "\n".join(line for _, line in lines)
    found = []
    for link in LINK.finditer(prose):
        number = lines[prose.count("\n", 0, link.end())][0]
        if not ELSEWHERE.match(link[1]):
            found.append((number, link[1]))
    return found


def problem_of(root, page, target):
    """What is wrong with a relative link, or None."""
    name, _, anchor = unquote(target).partition("#")
    path = (page.parent / name).resolve() if name else page
    if not path.is_relative_to(root):
        return "leads out of the repository"
    if path.is_dir():
        return "names a folder: name a file in it"
    if not path.is_file():
        return "there is no such file"
    if not anchor:
        return None
    if path.suffix != ".md":
        return "an anchor in what is no page"
    if anchor not in anchors_of(path.read_text(encoding="utf-8")):
        return f"no heading of {path.relative_to(root)} has this anchor, alone and in both spellings"
    return None


def gone_paths(root):
    """(page, line number, path) of each quoted path that does not exist, in the pages that list paths."""
    for name in PAGES_OF_PATHS:
        page = root / name
        lines = page.read_text(encoding="utf-8").splitlines() if page.is_file() else []
        for number, line in enumerate(lines, 1):
            for path in re.findall(r"`([^`\s]+/[^`\s]*)`", line):
                if not any(one.is_dir() == path.endswith("/") for one in root.glob(path)):
                    yield name, number, path


def check(root):
    """[what is wrong], in words for the reader."""
    wrong = [f"{name}:{number}: {path}: there is no such path" for name, number, path in gone_paths(root)]
    for page in pages_of(root):
        for number, target in links_of(page):
            problem = problem_of(root, page, target)
            if problem:
                wrong.append(f"{page.relative_to(root)}:{number}: {target}: {problem}")
    return wrong


def targets(root):
    """What the pages link to and is not a page, relative to `root`."""
    found = set()
    for page in pages_of(root):
        for _, target in links_of(page):
            path = (page.parent / unquote(target).partition("#")[0]).resolve()
            if path.is_file() and path.suffix != ".md":
                found.add(path.relative_to(root))
    return sorted(found)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--targets", action="store_true", help="print the files that are linked and are no pages")
    parser.add_argument("--pages", action="store_true", help="print the pages")
    parser.add_argument("--root", type=Path, default=ROOT)
    options = parser.parse_args(arguments)
    root = options.root.resolve()
    if options.targets or options.pages:
        listed = targets(root) if options.targets else [page.relative_to(root) for page in pages_of(root)]
        print("\n".join(map(str, listed)))
        return 0
    wrong = check(root)
    for line in wrong:
        print(f"error: {line}", file=sys.stderr)
    print(f"{len(pages_of(root))} pages, {len(wrong)} wrong links")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
