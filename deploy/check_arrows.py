#!/usr/bin/env python3
"""Checks the include graph of the folders: no cycle, no include against the layers, no crowded folder, no long file;
that hapticctl writes to the terminal in one place; that nothing in a tick reads a record; and that toml++ is included
with its guards.

    deploy/check_arrows.py [--root FOLDER] [--list]

--list prints each folder with its files, lines and the folders it includes from. Exit status 1 if a rule is broken.
"""
import argparse
import collections
import pathlib
import re
import sys

TOPS = ("proto", "hal", "rt", "server", "client", "tests")

# What a folder must never include from; cycles are forbidden anyway.
FORBIDDEN = [
    ("proto", ("hal", "rt", "server", "client", "tests")),
    ("hal", ("rt", "server", "client", "tests")),
    ("hal/sim", ("hal/netft", "hal/daq", "hal/phantom", "hal/openhaptics", "hal/replay")),
    ("rt", ("server", "client", "tests")),
    ("rt/record", ("rt/contact", "rt/control", "rt/deformation", "rt/guard", "rt/model", "rt/scene", "rt/loop")),
    ("rt/signal", ("rt/scene", "rt/model", "rt/loop")),
    ("rt/contact", ("rt/scene", "rt/model", "rt/loop")),
    ("rt/friction", ("rt/scene", "rt/model", "rt/loop")),
    ("rt/deformation", ("rt/scene", "rt/model", "rt/loop")),
    ("rt/modulation", ("rt/scene", "rt/model", "rt/loop")),
    ("rt/baseline", ("rt/scene", "rt/model", "rt/loop")),
    ("rt/target", ("rt/scene", "rt/loop")),
    ("rt/control", ("rt/scene", "rt/model", "rt/loop")),
    ("rt/guard", ("rt/scene", "rt/model", "rt/loop")),
    ("rt/scene", ("rt/loop",)),
    ("server", ("client", "tests")),
    ("server/identification/estimate", ("server/identification/session", "server/identification/run")),
    ("server/identification/gate", ("server/identification/session", "server/identification/estimate")),
    ("client", ("hal", "rt", "server", "tests")),
    ("client/cpp", ("client/cli", "client/console")),
    ("client/console", ("client/cli", "client/igtl")),
    ("client/console/access", ("client/console/daemon",)),
]
# Folders that depend on nothing and that all may include from.
SHARED = ("hal/lock",)
MAX_FILES = 26  # .h and .cpp of one folder
MAX_LINES = 400  # of a file outside the tests
# Longer files, each with its reason.
LONG_FILES = {}

# What writes to a terminal past client/cli/session/print.h, where texts of others are escaped.
RAW_OUTPUT = re.compile(r"\bfmt::print\(|\bstd::(?:cout|cerr|clog|puts|fputs|printf|print)\b|\bprintf\(|\bfwrite\(.*\bstd(?:out|err)\b")
PRINTERS = ("client/cli/session/print.cpp",)

# The one place that includes a library whose assumptions need guards, before texts from outside may reach it.
GUARDED = {"toml++/": "proto/text/toml_library.h"}

# In a tick a record is only filled: by a const method fill_...(), which can keep nothing of what it would read.
RECORD_FOLDERS = ("rt/record", "rt/loop")  # the record itself, and the ring that hands it on
RECORD_FILLER = re.compile(r"\bvoid (?:\w+::)?fill_\w+\([^()]*\bTickRecord& ?(?:record)?\) const noexcept")
# What else may take a record, each with its reason. It may not read it either.
RECORD_TAKERS = {
    "rt/scene/fill_contact.h": "a free function, which keeps nothing",
    "rt/scene/renderer.cpp": "Renderer::tick() hands the record on to those that fill it",
    "rt/scene/renderer.h": "Renderer::tick() hands the record on to those that fill it",
}
RECORD_READ = re.compile(r"\brecord(?:\.\w+)+(?![\w.])(?!\s*\|?=[^=])")
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)

INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)
SYSTEM_INCLUDE = re.compile(r"^#include <([^>]+)>", re.MULTILINE)


def within(folder, part):
    return folder == part or folder.startswith(part + "/")


def read_graph(root):
    """Folder → folder → the (file, included file) pairs between them; folder → number of files; file → lines."""
    files = {path.relative_to(root).as_posix(): path
             for top in TOPS for path in (root / top).rglob("*") if path.suffix in (".h", ".cpp")}
    arrows = collections.defaultdict(lambda: collections.defaultdict(list))
    count, lines = collections.Counter(), collections.Counter()
    for name, path in sorted(files.items()):
        folder = name.rpartition("/")[0]
        text = path.read_text(encoding="utf-8")
        count[folder] += 1
        lines[name] = text.count("\n")
        for included in INCLUDE.findall(text):
            other = included.rpartition("/")[0]
            if included in files and other != folder:
                arrows[folder][other].append((name, included))
    return arrows, count, lines


def cycles(arrows, folders):
    """Strongly connected folders, by Tarjan's algorithm."""
    index, low, stack, found = {}, {}, [], []

    def visit(folder):
        index[folder] = low[folder] = len(index)
        stack.append(folder)
        for other in arrows[folder]:
            if other not in index:
                visit(other)
                low[folder] = min(low[folder], low[other])
            elif other in stack:
                low[folder] = min(low[folder], index[other])
        if low[folder] == index[folder]:
            component = stack[stack.index(folder):]
            del stack[stack.index(folder):]
            if len(component) > 1:
                found.append(component)

    for folder in sorted(folders):
        if folder not in index:
            visit(folder)
    return found


def long_files(lines, reasons=LONG_FILES):
    """Files outside the tests with more than MAX_LINES that have no reason, and reasons of files that are not long."""
    long = {name for name, count in lines.items() if count > MAX_LINES and not within(name, "tests")}
    for name in sorted(long - reasons.keys()):
        yield f"{name} has {lines[name]} lines: at most {MAX_LINES}; split it by what its parts do"
    for name in sorted(reasons.keys() - long):
        yield f"{name} is listed as long, and is not: take it off the list"


def problems(arrows, count):
    for component in cycles(arrows, count):
        yield "a cycle between " + ", ".join(sorted(component))
        for folder in component:
            for other in component:
                for name, included in arrows[folder].get(other, [])[:3]:
                    yield f"    {name} includes {included}"
    for folder in sorted(arrows):
        for part, banned in FORBIDDEN:
            if not within(folder, part):
                continue
            for other, pairs in arrows[folder].items():
                if any(within(other, b) for b in banned) and not within(other, part) and other not in SHARED:
                    for name, included in pairs:
                        yield f"{name} includes {included}: {part} must not include from {other}"
    for folder in SHARED:
        for other, pairs in arrows[folder].items():
            for name, included in pairs:
                yield f"{name} includes {included}: {folder} must not include from {other}"
    for folder, files in sorted(count.items()):
        if files > MAX_FILES:
            yield f"{folder} has {files} files: at most {MAX_FILES}; sort them into folders of one concept each"


def raw_output(root):
    """Lines of hapticctl that write to the terminal without its printer."""
    for path in sorted((root / "client/cli").rglob("*.[ch]*")):
        name = path.relative_to(root).as_posix()
        if name in PRINTERS:
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if RAW_OUTPUT.search(line.partition("//")[0]):
                yield f"{name}:{number} writes past {PRINTERS[0]}: use print_line(), print_error_line() or print_text()"


def unguarded_includes(root):
    """Files that include a library past the header that guards it."""
    for path in sorted(path for top in TOPS for path in (root / top).rglob("*") if path.suffix in (".h", ".cpp")):
        name = path.relative_to(root).as_posix()
        for included in SYSTEM_INCLUDE.findall(path.read_text(encoding="utf-8")):
            for library, guard in GUARDED.items():
                if included.startswith(library) and name != guard:
                    yield f"{name} includes {included}: include {guard}"


def record_readers(root):
    """What in a tick takes a record otherwise than to fill it, or reads one."""
    for path in sorted((root / "rt").rglob("*.[ch]*")):
        name = path.relative_to(root).as_posix()
        if any(within(name, folder) for folder in RECORD_FOLDERS):
            continue
        text = COMMENT.sub("", path.read_text(encoding="utf-8"))
        for statement in re.split(r"[;{}]", text):
            if "TickRecord" in statement and name not in RECORD_TAKERS and not RECORD_FILLER.search(statement):
                yield f"{name} takes a record: {' '.join(statement.split())}: fill it in a const method fill_record()"
        for read in RECORD_READ.findall(text):
            yield f"{name} reads {read}: a tick reads no record; take the value from the stage that knows it"
        if re.search(r"\bmutable\b", text):
            yield f"{name} has something mutable: a const method that fills a record could keep what it reads"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    arrows, count, lines = read_graph(options.root)
    if not count:
        print(f"check_arrows.py: no sources below {options.root}", file=sys.stderr)
        return 1
    if options.list:
        for folder in sorted(count):
            own = sum(n for name, n in lines.items() if name.rpartition("/")[0] == folder)
            print(f"{folder}: {count[folder]} files, {own} lines -> {', '.join(sorted(arrows[folder]))}")
    found = list(problems(arrows, count)) + list(long_files(lines)) + list(raw_output(options.root))
    found += list(unguarded_includes(options.root)) + list(record_readers(options.root))
    for problem in found:
        print(f"check_arrows.py: {problem}", file=sys.stderr)
    if not found:
        print(f"check_arrows.py: {len(count)} folders, {sum(len(a) for a in arrows.values())} arrows, no cycle")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
