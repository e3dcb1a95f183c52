#!/usr/bin/env python3
"""Fails when a number in the text is not the measured one.

    python3 deploy/check_figures.py --static                  without figures: marks, definitions and texts fit together
    python3 deploy/check_figures.py --figures OUT/figures.jsonl           of a full run: every marked number
    python3 deploy/check_figures.py --figures OUT/figures.jsonl --quick   of a quick run: see below
    python3 deploy/check_figures.py --figures OUT/figures.jsonl --write   put into the texts what is held to these figures

In a Markdown text a mark is a comment directly behind a number, or behind a range of two ("a … b"):

    −1.2 … +0.1<!--held_1d--> %

A page of docs has no other numbers with a unit than these: in its paragraph, item or row of a table is a mark, or a †
(measured earlier, and not again), or deploy/given_numbers.toml lists it for the page as given, such as a setting, a limit or
a fact of the dissertation. A † in the first paragraph under the title holds for the page. Code does not count.

deploy/figures.toml defines it: the run and figure it comes from, which cases count, how they become one number or a
range, the rounding. One line each:

    held_1d = { figure = "rig/rendered_stiffness_error", case = { plant = "separable" }, show = "range %+.1f", factor = 100 }

    figure    RUN/FIGURE; RUN is a folder that deploy/figures.sh makes
    case      conditions that must hold: a value, or a list of which one must be; optional
    not       conditions that must not hold, in the same form; optional
    show      one of min, max, median, mean, sum, count, within (how many are no larger than their goal),
              only (exactly one record), range (min … max), and the format, of the printf family
    factor    the values times this, e.g. 100 for percent; optional
    failed    how many of the records gave no value; 0 unless it says so, so that none is passed over in silence
    tolerance  share by which the text may differ from what was measured: of a count of instructions, which differs a
              little from one compiler and library to the next; optional
    machine   true: a figure of the machine and its load; a difference is reported and fails nothing; optional
    in_quick  true: the quick run measures just this as well and is held to it; other numbers of a quick run come of
              fewer cases, so that only their being there is asked; optional
    only_full  true: of a case that the quick run leaves out; optional
    recordings  true: of real recordings; with --without-recordings only reported; optional

Exit status: 0 all is well, 1 a text is wrong, 2 the command line or a file cannot be read. Python's own library only.
"""

import argparse
import json
import re
import statistics
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TEXTS = ("README.md", "docs/*.md", "hal/sim/README.md")
SOURCES = ("tests/measure",)
GIVEN = ROOT / "deploy/given_numbers.toml"

MARK = re.compile(r"<!--([a-z][a-z0-9_]*)-->")
# 28 992, −1.2, +0.1, 1e-9
NUMBER = r"[+\-−]?(?:\d{1,3}(?: \d{3})+(?![\d.])|\d+(?:\.\d+)?(?:e[+-]?\d+)?)"
BEFORE_MARK = re.compile(rf"(?:({NUMBER}) … )?({NUMBER})$")
SHOW = re.compile(r"(min|max|median|mean|sum|count|within|only|range) (%\+?\.\d+[feg]|%\+?d)")
FIGURE = re.compile(r"([a-z_]+)/([a-z][a-z0-9_]*)")
KEYS = {"figure", "case", "not", "show", "factor", "failed", "machine", "tolerance", "in_quick", "only_full", "recordings"}
# Columns of a table that hold no measured number: what is printed first, and what it is compared with.
UNMEASURED = re.compile(r"to compare|reported|goal|dissertation: ")

REDUCE = {
    "min": min,
    "max": max,
    "median": statistics.median,
    "mean": statistics.fmean,
    "sum": sum,
    "count": len,
}


class Complaint(Exception):
    """What is wrong, in words for the reader."""


def plain(number):
    """A number as the text has it → as Python prints it."""
    return number.replace("−", "-").replace(" ", "")


def numbers_before(text, position):
    """The one or two numbers that end at `position`; none if no number is there."""
    found = BEFORE_MARK.search(text[:position])
    return [plain(number) for number in found.groups() if number] if found else []


class Definition:
    """The meaning of one mark. Complaint if it is malformed."""

    def __init__(self, name, table):
        if not isinstance(table, dict):
            raise Complaint(f"{name}: is no table in braces")
        for key in table:
            if key not in KEYS:
                raise Complaint(f"{name}: no key '{key}'; there are {', '.join(sorted(KEYS))}")
        figure = FIGURE.fullmatch(str(table.get("figure", "")))
        if not figure:
            raise Complaint(f"{name}: figure must be RUN/FIGURE, not '{table.get('figure', '')}'")
        show = SHOW.fullmatch(str(table.get("show", "")))
        if not show:
            raise Complaint(f"{name}: show must be like 'range %+.1f', not '{table.get('show', '')}'")
        for key in ("case", "not"):
            if not isinstance(table.get(key, {}), dict):
                raise Complaint(f"{name}: {key} must be a table in braces")
        self.name = name
        self.run, self.figure = figure.groups()
        self.aggregate, self.format = show.groups()
        self.case = table.get("case", {})
        self.excluded = table.get("not", {})
        self.factor = table.get("factor", 1)
        self.failed = table.get("failed", 0)
        self.machine = table.get("machine", False)
        self.tolerance = table.get("tolerance", 0)
        self.in_quick = table.get("in_quick", False)
        self.only_full = table.get("only_full", False)
        self.recordings = table.get("recordings", False)

    def __str__(self):
        conditions = [f"{key}={value}" for key, value in self.case.items()]
        conditions += [f"{key}≠{value}" for key, value in self.excluded.items()]
        return f"{self.run}/{self.figure}" + (f" ({', '.join(conditions)})" if conditions else "")

    def matches(self, record):
        def holds(key, wanted):
            wanted = wanted if isinstance(wanted, list) else [wanted]
            return key in record["case"] and record["case"][key] in wanted

        return (
            record.get("run") == self.run
            and record["figure"] == self.figure
            and all(holds(key, wanted) for key, wanted in self.case.items())
            and not any(holds(key, unwanted) for key, unwanted in self.excluded.items())
        )

    def printed(self, records, whole=True):
        """What the text must have, one number or two. Complaint if the records do not give it; `whole`: or if a
        condition that is listed, or more values than are said to be, are missing."""
        ours = [record for record in records if self.matches(record)]
        values = [self.factor * record["value"] for record in ours if record["value"] is not None]
        if not values:
            raise Complaint(f"no value of {self}")
        if whole:
            for key, wanted in self.case.items():
                for value in wanted if isinstance(wanted, list) else [wanted]:
                    if not any(record["case"][key] == value for record in ours):
                        raise Complaint(f"no record of {self} has {key} {value}")
        without = len(ours) - len(values)
        if whole and without != self.failed:
            raise Complaint(f"{without} of {len(ours)} records of {self} have no value, {self.failed} expected (failed = )")
        if self.aggregate == "only":
            if len(values) != 1:
                raise Complaint(f"{len(values)} values of {self}; 'only' wants one")
            results = values
        elif self.aggregate == "within":
            goals = [record for record in ours if record["value"] is not None and record.get("goal") is not None]
            results = [sum(1 for record in goals if record["value"] <= record["goal"])]
        elif self.aggregate == "range":
            results = [min(values), max(values)]
        else:
            results = [REDUCE[self.aggregate](values)]
        # Rounded first; then adding zero makes a negative zero a positive one.
        return [self.format % (float(self.format % result) + 0.0) for result in results]

    def is_near(self, printed, measured):
        """Whether all numbers of the text differ by no more than the tolerance."""
        pairs = [(float(old), float(new)) for old, new in zip(printed, measured)]
        return len(printed) == len(measured) and all(abs(old - new) <= self.tolerance * abs(new) for old, new in pairs)

    def decimals(self):
        """Digits behind the point that the format prints; None if it does not fix them."""
        if self.format.endswith("d"):
            return 0
        return int(self.format[self.format.index(".") + 1 : -1]) if self.format.endswith("f") else None


def read_definitions(path, complaints):
    """name → Definition; what is malformed is complained of and left out."""
    definitions = {}
    for name, table in tomllib.loads(path.read_text(encoding="utf-8")).items():
        try:
            definitions[name] = Definition(name, table)
        except Complaint as complaint:
            complaints.append(f"{path.name}: {complaint}")
    return definitions


class Mark:
    """A mark in a text with the numbers before it."""

    def __init__(self, text, line_number, line, match):
        self.where = f"{text}:{line_number}"
        self.name = match.group(1)
        self.numbers = numbers_before(line, match.start())


def shown(path):
    """A text as complaints name it."""
    return path.relative_to(ROOT) if path.is_relative_to(ROOT) else path.name


def marks_in(path):
    for line_number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        for match in MARK.finditer(line):
            yield Mark(shown(path), line_number, line, match)


def unmarked_numbers(path):
    """[(line, heading, unmarked, marked)] of every table that holds measured numbers: those with a mark in it or
    a column 'measured'. Counted are numbers outside the first column and those of what they are compared with."""
    tables = []
    headings = None
    for line_number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if not line.startswith("|"):
            headings = None
            continue
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if headings is None:
            headings = cells
            tables.append([line_number, " | ".join(cells), 0, 0])
            continue
        for heading, cell in list(zip(headings, cells))[1:]:
            if UNMEASURED.search(heading):
                continue
            marked = sum(len(numbers_before(cell, match.start())) for match in MARK.finditer(cell))
            printed = re.sub(r"`[^`]*`", "", MARK.sub("", cell))
            tables[-1][2] += len(re.findall(rf"(?<![\w.§]){NUMBER}(?![\w])", printed)) - marked
            tables[-1][3] += marked
    return [table for table in tables if table[3] > 0 or "measured" in table[1]]


UNIT = re.compile(
    rf"(?<![\w.§/^<-])({NUMBER})[ \u00a0]?"
    r"(%|N/mm|N/s|N·mm|[mµk]?N|mm/s|[µkcm]?m|[mµn]?s|k?Hz|[kMG]B|°|m?J|W|k?g|min|hours|instructions|ticks)(?![\w/·²])"
)
FENCED = re.compile(r"^```.*?^```", re.S | re.M)
NEW_BLOCK = re.compile(r"\s*$|\||#|\s*(-|\d+\.) ")


def blocks_of(text):
    """(line, text) of each paragraph, item of a list and row of a table, without code."""
    text = FENCED.sub(lambda code: "\n" * code[0].count("\n"), text)
    blocks = []
    for line_number, line in enumerate(text.splitlines(), 1):
        if NEW_BLOCK.match(line) or not blocks or not blocks[-1][1]:
            blocks.append((line_number, ""))
        blocks[-1] = (blocks[-1][0], (blocks[-1][1] + " " + re.sub(r"`[^`]*`", "", line)).strip())
    return [block for block in blocks if block[1]]


def unexplained_numbers(text, given):
    """[(line, "5 mm")] of the numbers with a unit in a page that have neither mark nor †, and are not given."""
    blocks = blocks_of(text)
    if len(blocks) > 1 and "†" in blocks[1][1] and not blocks[1][1].startswith("†:"):
        return []
    return [
        (line, f"{plain(number)} {unit}")
        for line, block in blocks
        if "†" not in block and not MARK.search(block)
        for number, unit in UNIT.findall(block)
        if f"{plain(number)} {unit}" not in given
    ]


def check_explained(pages, given, complaints):
    """Every number with a unit is measured, said to be old, or given; nothing is given that no page has."""
    for path in pages:
        name = str(shown(path))
        text = path.read_text(encoding="utf-8")
        for line, number in unexplained_numbers(text, given.get(name, [])):
            complaints.append(f"{name}:{line}: {number} has neither a mark nor a †, and is not in given_numbers.toml")
        found = {f"{plain(number)} {unit}" for _, block in blocks_of(text) for number, unit in UNIT.findall(block)}
        for number in given.get(name, []):
            if number not in found:
                complaints.append(f"given_numbers.toml: {name} has no '{number}'")


def check_static(marks, definitions, sources, complaints):
    """Marks and definitions fit together, numbers have the form their definition prints, figures and conditions are
    named by a study or a benchmark."""
    literals = set()
    for source in sources:
        literals.update(re.findall(r'"([a-z][a-z0-9_]*)"', source))
    for definition in definitions.values():
        if definition.figure not in literals:
            complaints.append(f"{definition.name}: no study or benchmark names a figure '{definition.figure}'")
        for key in list(definition.case) + list(definition.excluded):
            if key not in literals:
                complaints.append(f"{definition.name}: no study or benchmark names a condition '{key}'")
    used = set()
    for mark in marks:
        used.add(mark.name)
        definition = definitions.get(mark.name)
        if not mark.numbers:
            complaints.append(f"{mark.where}: there is no number directly before the mark '{mark.name}'")
        elif definition is None:
            complaints.append(f"{mark.where}: nothing defines the mark '{mark.name}'")
        else:
            check_form(mark, definition, complaints)
    for name in definitions:
        if name not in used:
            complaints.append(f"no text has the mark '{name}' that is defined")


def check_form(mark, definition, complaints):
    if definition.aggregate == "range" and len(mark.numbers) != 2:
        complaints.append(f"{mark.where}: '{mark.name}' is a range, but there is only {mark.numbers[-1]} before it")
    numbers = mark.numbers if definition.aggregate == "range" else mark.numbers[-1:]
    decimals = definition.decimals()
    for number in numbers:
        if decimals is not None and ("e" in number or len(number.partition(".")[2]) != decimals):
            complaints.append(f"{mark.where}: {number} is not of the form {definition.format} of '{mark.name}'")


def check_figures(marks, definitions, records, options, complaints, remarks):
    """The text has what the records give."""
    for mark in marks:
        definition = definitions.get(mark.name)
        if definition is None or not mark.numbers:
            continue  # check_static complains of it
        excused = (definition.machine or (definition.recordings and options.without_recordings)
                   or (definition.only_full and options.quick))
        held_to_it = not excused and (not options.quick or definition.in_quick)
        try:
            measured = definition.printed(records, whole=held_to_it)
        except Complaint as complaint:
            (remarks if excused else complaints).append(f"{mark.where}: '{mark.name}': {complaint}")
            continue
        printed = mark.numbers if definition.aggregate == "range" else mark.numbers[-1:]
        if printed == measured or definition.is_near(printed, measured):
            continue
        text = f"{mark.where}: '{mark.name}' says {' … '.join(printed)}, measured {' … '.join(measured)}"
        (complaints if held_to_it else remarks).append(text)


def typeset(number):
    """Number as the text writes it: a real minus, thousands apart."""
    whole, point, rest = number.partition(".")
    if re.fullmatch(r"[+-]?\d{5,}", whole):
        whole = f"{int(whole):+,}" if whole.startswith("+") else f"{int(whole):,}"
    return (whole.replace(",", " ") + point + rest).replace("-", "−")


def write_measured(path, definitions, records, quick, complaints):
    """Puts the measured numbers before the marks of a text."""
    printed = path.read_text(encoding="utf-8")

    def measured(found):
        definition = definitions.get(found["mark"])
        try:
            if definition is None:
                raise Complaint("nothing defines it")
            if quick and not definition.in_quick:
                return found[0]
            numbers = [typeset(number) for number in definition.printed(records)]
        except Complaint as complaint:
            complaints.append(f"{shown(path)}: '{found['mark']}' is left as it was: {complaint}")
            return found[0]
        before = f"{found['first']} … " if found["first"] and len(numbers) == 1 else ""
        return f"{before}{' … '.join(numbers)}<!--{found['mark']}-->"

    text = re.sub(rf"(?:(?P<first>{NUMBER}) … )?{NUMBER}<!--(?P<mark>[a-z][a-z0-9_]*)-->", measured, printed)
    path.write_text(text, encoding="utf-8")


def read_records(path):
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line]


def main(arguments=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("texts", nargs="*", type=Path, help=f"Markdown texts; default {' '.join(TEXTS)}")
    parser.add_argument("--figures", type=Path, help="what deploy/figures.sh collected")
    parser.add_argument("--quick", action="store_true", help="the figures are of a quick run")
    parser.add_argument("--without-recordings", action="store_true", help="none were at hand")
    parser.add_argument("--static", action="store_true", help="without figures")
    parser.add_argument("--write", action="store_true", help="put what was measured into the text")
    parser.add_argument("--definitions", type=Path, default=ROOT / "deploy" / "figures.toml")
    parser.add_argument("--sources", nargs="*", type=Path, default=[ROOT / folder for folder in SOURCES])
    options = parser.parse_args(arguments)
    if options.static == (options.figures is not None):
        parser.error("either --static or --figures FILE")
    if options.write and options.static:
        parser.error("--write wants figures")

    complaints, remarks = [], []
    try:
        texts = options.texts or [path for name in TEXTS for path in sorted(ROOT.glob(name))]
        definitions = read_definitions(options.definitions, complaints)
        records = read_records(options.figures) if options.figures else []
        marks = [mark for text in texts for mark in marks_in(text)]
        tables = {text: unmarked_numbers(text) for text in texts}
        sources = [
            path.read_text(encoding="utf-8")
            for folder in options.sources
            for path in sorted(folder.rglob("*"))
            if path.suffix in (".cpp", ".h", ".py", ".sh") and not path.name.endswith("_test.cpp")
        ]
    except (OSError, ValueError) as error:
        print(f"check_figures.py: {error}", file=sys.stderr)
        return 2

    if options.write:
        for text in texts:
            write_measured(text, definitions, records, options.quick, complaints)
        marks = [mark for text in texts for mark in marks_in(text)]

    check_static(marks, definitions, sources, complaints)
    if not options.texts:  # all pages; contract.md is made from the contract
        pages = [path for path in sorted(ROOT.glob("docs/*.md")) if path.name != "contract.md"]
        check_explained(pages, tomllib.loads(GIVEN.read_text(encoding="utf-8")), complaints)
    if options.figures:
        check_figures(marks, definitions, records, options, complaints, remarks)
    for remark in remarks:
        print(f"differs, as it may: {remark}")
    for text, rows in tables.items():
        for line_number, heading, unmarked, marked in rows:
            print(f"{shown(text)}:{line_number}: {marked} numbers marked, {unmarked} not: {heading}")
    for complaint in complaints:
        print(f"error: {complaint}", file=sys.stderr)
    print(f"{len(marks)} marks, {len(complaints)} errors")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
