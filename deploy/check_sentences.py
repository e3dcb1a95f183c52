#!/usr/bin/env python3
"""Checks comments and pages for sentences that are hard to read, and comments for functions that are gone.

    deploy/check_sentences.py [--root FOLDER] [--count] [PATH …]

Reads the comments of C++, .proto, Python and JavaScript files, and the Markdown pages; or only those below each PATH.
Code, strings, `quoted code` and "quoted text" are not read. --count prints only how often each pattern occurs. Exit
status 1 if a pattern is found.
"""
import argparse
import bisect
import collections
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import comment_texts  # noqa: E402

SKIPPED = {"build", "out", "third_party", "__pycache__"}
MAX_README_COLUMNS = 120

# Words that cannot open a doc comment: what follows needs the line above it, or is not a sentence.
OPENERS = """
    It Its They Their This That These Those There Here Same
    And But Or So Then Also Else Because
    Of Who Whose Whom Which Where When While Until
    As At After Before Beyond Below Above Between Within Without With By For From In Into Like Off On Out Over To Under
    Not None
""".split()

# Words after which "where" means "if": "empty where", "FAILED_PRECONDITION where".
OUTCOMES = (
    r"[Aa]bsent|[Ee]mpty|[Nn]one|[Zz]ero|0|[Ff]alse|[Tt]rue|[Nn]othing|[Nn]ull|nullptr|[Rr]efused|NaN|(?<!target )[Ee]rror"
    r"|[Ff]ails|also|even|[Ii]nfinite|[Uu]nknown|-1|[A-Z]{3,}_[A-Z_]+|k[A-Z]\w+\)?"
    r"|[Tt]hrows|(?:[Rr]aises|[Tt]hrows) \w+(?: \([^)]*\))?|\w+_error|invalid_argument|[A-Z]\w*Error(?: \([^)]*\))?"
)
COMPARISONS = "longer|more|less|worse|better|different|larger|greater|smaller|higher|lower"

# name → (pattern, what to write instead). Matched in a comment, a paragraph, an item or a cell.
PATTERNS = {
    "is no X": (
        re.compile(rf"(?<!there )(?<!There )\b(?:is|are|was|were) no (?!(?:{COMPARISONS})\b)\w+"),
        '"is not a …", "has no …", or the word for what it is',
    ),
    "of its own": (re.compile(r"(?<!one )\bof (?:its|their) own\b"), '"its own …", "a separate …"'),
    "stands": (
        re.compile(r"\b[Ss]tands?\b(?! (?:in )?for\b)(?!-)|\bstood\b"),
        '"is", "is written", "is at rest", "applies"',
    ),
    "Where": (
        re.compile(
            r"(?:^|(?<=[.:;] ))Where (?=[^.?;]*, )"
            r"|\bwhere (?:there (?:is|are|was|were)|no|none|nothing|not|it is not)\b"
            rf"|\b(?:{OUTCOMES}) where\b"
        ),
        '"if …", "when …"; "where" only for a place',
    ),
    "Of": (re.compile(r"^Of (?!course\b)|(?<=[.;] )Of an? "), 'the noun first: "Noise of the sensor"'),
    "no one": (re.compile(r"\b[Nn]o[ -]one\b"), '"no client", "no thread", "nothing", or the passive'),
    "who": (
        re.compile(
            r"(?:^|(?<=[.;:] ))Who(?:ever)? (?![^.]*\?)"
            r"|\b(?:[Ff]or|[Oo]f|[Bb]y|[Tt]o|[Tt]hat|[Aa]s) who(?:ever)?\b"
        ),
        'the noun: "a client that …", "the caller", "readers that …"',
    ),
}

# (file or folder, pattern) → why it may stay.
ALLOWED = {
    ("docs/faults.md", "no one"): "its table repeats what the program prints (rt/guard/fault_table.h)",
}
# Pages that scripts make of comments, which are read themselves.
GENERATED = ("docs/contract.md",)

QUOTED = re.compile(r"`[^`]*`|\"[^\"]*\"|“[^”]*”")
CALL = re.compile(r"(?<![\w.])((?:\w+::)*)~?(\w+)\(\)")
# A class or namespace that is declared, or one of whose functions is defined.
OWNER = re.compile(
    r"\b(?:class|struct|union|namespace)\s+(?:[A-Z_]+\([^)]*\)\s*)?((?:\w+::)*\w+)|\b(\w+)::~?\w+\("
)
# Functions that only an example in a comment names.
EXAMPLES = {"show_progress", "read_pedal"}


def problems_of(text):
    """(line number, name of the pattern, excerpt, what to write instead) of one text."""
    joined, starts = text.joined()
    masked = QUOTED.sub(lambda match: "`" * len(match[0]), joined)
    first = re.match(r"(?:The )?(\w+)", masked)
    if text.doc and first and (first[1] in OPENERS or first[0] == "The same"):
        yield text.number, "opener", joined[:40], "a noun or a verb first: a sentence that needs no line above it"
    for name, (pattern, instead) in PATTERNS.items():
        for match in pattern.finditer(masked):
            line = text.number + bisect.bisect_right(starts, match.start()) - 1
            yield line, name, joined[max(0, match.start() - 15):match.end() + 25], instead


def within(name, parts):
    return any(name == part or name.startswith(part.rstrip("/") + "/") for part in parts)


def check_file(name, text):
    """(place, pattern, words for the reader) of each problem of one file."""
    if name in GENERATED:
        return
    for block in comment_texts.READERS[pathlib.PurePosixPath(name).suffix](text):
        for number, pattern, excerpt, instead in problems_of(block):
            if not any(pattern == allowed and within(name, [part]) for part, allowed in ALLOWED):
                yield f"{name}:{number}", pattern, f'"… {excerpt.strip()} …": write {instead}'
    if name.endswith("README.md"):
        for number, line in enumerate(text.splitlines(), 1):
            if len(line) > MAX_README_COLUMNS:
                yield f"{name}:{number}", "long line", f"{len(line)} columns: at most {MAX_README_COLUMNS}"


def gone_functions(files):
    """(place, pattern, words) of each name() or Class::name() in a C++ comment that no C++ code has."""
    words, members = set(EXAMPLES), collections.defaultdict(set)  # identifiers; class → identifiers of its files
    for text in files.values():
        code = comment_texts.without_comments(text)
        found = set(re.findall(r"[A-Za-z_]\w*", code))
        words |= found
        for owner in OWNER.findall(code):
            members[(owner[0] or owner[1]).rpartition("::")[2]] |= found
    for name, text in files.items():
        for block in comment_texts.c_comments(text):
            for match in CALL.finditer(block.joined()[0]):
                owner = match[1].rstrip(":").rpartition("::")[2]
                if match[2] not in words or (owner in members and match[2] not in members[owner]):
                    yield f"{name}:{block.number}", "gone", f'"{match[0]}": there is no such function'


def files_of(root, paths):
    for path in sorted(root.rglob("*")):
        name = path.relative_to(root).as_posix()
        folders = name.split("/")[:-1]
        if any(folder in SKIPPED or folder.startswith(".") for folder in folders):
            continue
        if path.suffix in comment_texts.READERS and path.is_file() and (not paths or within(name, paths)):
            yield name, path


def check(root, paths=()):
    """All problems below `root`."""
    texts = {name: path.read_text(encoding="utf-8") for name, path in files_of(root, paths)}
    found = [problem for name, text in texts.items() for problem in check_file(name, text)]
    if not paths:  # a part of the project names functions of the rest
        found += gone_functions({name: text for name, text in texts.items() if name.endswith((".h", ".cpp"))})
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    parser.add_argument("--count", action="store_true")
    parser.add_argument("paths", nargs="*")
    options = parser.parse_args()
    found = check(options.root.resolve(), options.paths)
    if not options.count:
        for place, pattern, words in found:
            print(f"{place}: {pattern}: {words}", file=sys.stderr)
    for pattern, count in collections.Counter(pattern for _, pattern, _ in found).most_common():
        print(f"check_sentences.py: {count} × {pattern}")
    if not found:
        print("check_sentences.py: no pattern found")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
