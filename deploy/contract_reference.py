#!/usr/bin/env python3
"""Makes docs/contract.md, the reference of the contract, from the comments of the .proto files.

    deploy/contract_reference.py [--write] without --write: exit status 1 if the page is out of date
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROTO = ROOT / "proto/hapticd/v1"
PAGE = ROOT / "docs/contract.md"
ORDER = "rig scene model rendering safety telemetry pose simulation identification calibration turntable guide presentation access watchdog clock recording event experiment common".split()

BLOCK = re.compile(r"^(\s*)(service|message|enum|oneof)\s+(\w+)\s*\{(\s*\})?")
METHOD = re.compile(r"^rpc (\w+)\((stream )?(\w+)\) returns \((stream )?(\w+)\)")
FIELD = re.compile(r"^(repeated |optional )?([\w.]+) (\w+) = (\d+)")
VALUE = re.compile(r"^(\w+) = (\d+);")


def cell(text):
    return text.replace("|", "\\|").strip()


class Reader:
    """Reads one file line by line: comments belong to what follows them, or are behind it on the same line."""

    def __init__(self, name):
        self.name, self.path, self.comment, self.lines = name, [], [], []
        self.rows = []  # of the innermost service, message or enum

    def read(self):
        text = (PROTO / f"{self.name}.proto").read_text(encoding="utf-8")
        self.lines.append(f"## {self.name}.proto\n")
        for line in text.split("\n"):
            self.take(line)
        return self.lines

    def take(self, line):
        code, _, behind = line.partition("//")
        code = code.strip()
        if not code:
            if behind:
                self.comment.append(behind.strip())
            else:
                self.comment = []
            return
        block = BLOCK.match(line)
        if block:
            return self.open(block.group(2), block.group(3), bool(block.group(4)))
        if code.startswith("}"):
            return self.close()
        words = " ".join([*self.comment, behind.strip()]).strip()
        self.comment = []
        if method := METHOD.match(code):
            name, streams_in, request, streams_out, answer = method.groups()
            arrow = f"{'stream of ' if streams_in else ''}`{request}` → {'stream of ' if streams_out else ''}`{answer}`"
            self.rows.append((f"`{name}`", arrow, words))
        elif value := VALUE.match(code):
            self.rows.append((f"`{value.group(1)}`", value.group(2), words))
        elif field := FIELD.match(code):
            self.rows.append((f"`{field.group(3)}`", (field.group(1) or "") + field.group(2), words))

    def open(self, kind, name, is_empty):
        words = " ".join(self.comment)
        self.comment = []
        if kind == "oneof":
            self.path.append(None)
            self.rows.append(("*one of:*", "", words))
            return
        self.flush()
        self.path.append((kind, name))
        title = ".".join(part[1] for part in self.path if part)
        self.lines.append(f"### {kind} {title}\n")
        if words:
            self.lines.append(words + "\n")
        if is_empty:
            self.path.pop()

    def close(self):
        if self.path and self.path.pop() is not None:
            self.flush()
        self.comment = []

    def flush(self):
        if self.rows:
            self.lines.append("| name | type | |\n|---|---|---|")
            self.lines += [f"| {cell(a)} | {cell(b)} | {cell(c)} |" for a, b, c in self.rows]
            self.lines.append("")
        self.rows = []


def page():
    names = {path.stem for path in PROTO.glob("*.proto")}
    assert names == set(ORDER), f"ORDER and the files differ: {names ^ set(ORDER)}"
    lines = ["# Reference of the contract\n",
             "Made from the comments in `proto/hapticd/v1` by `deploy/contract_reference.py`; edit those. The rules that hold for "
             "all of it: [Rules of the contract](../proto/CONTRACT.md).\n"]
    for name in ORDER:
        lines += Reader(name).read()
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).rstrip() + "\n"


def main():
    made = page()
    if "--write" in sys.argv:
        PAGE.write_text(made, encoding="utf-8")
        return 0
    if not PAGE.exists() or PAGE.read_text(encoding="utf-8") != made:
        print(f"contract_reference.py: {PAGE.relative_to(ROOT)} is out of date; run it with --write", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
