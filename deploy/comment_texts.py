"""The texts that people read in a source file or a page: comments, docstrings, paragraphs. For check_sentences.py."""

import ast
import bisect
import io
import re
import sys
import tokenize
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import check_links  # noqa: E402


class Text:
    """A comment or a paragraph: its lines, the number of the first one, and whether it documents a declaration."""

    def __init__(self, number, line, doc=False):
        self.number, self.lines, self.doc = number, [line], doc

    def joined(self):
        """The text as one line, and the offsets at which its lines begin."""
        starts, length = [], 0
        for line in self.lines:
            starts.append(length)
            length += len(line) + 1
        return " ".join(self.lines), starts


C_TOKEN = re.compile(
    r'R"(?P<mark>[^()\s]{0,16})\(.*?\)(?P=mark)"'
    r'|"(?:\\.|[^"\\\n])*"'
    r"|(?<![0-9A-Fa-f])'(?:\\.|[^'\\\n])*'"
    r"|(?P<comment>//[^\n]*|/\*.*?\*/)",
    re.DOTALL,
)


def c_comments(text, doc_mark="///"):
    """Texts of the comments of C++, .proto and JavaScript; lines of comments below each other are one text."""
    ends = [match.end() for match in re.finditer("\n", text)]
    found, last = [], None  # last: (line number, column) of the comment that a next line may continue
    for match in C_TOKEN.finditer(text):
        comment = match["comment"]
        if comment is None:
            continue
        number = bisect.bisect_right(ends, match.start()) + 1
        column = match.start() - (ends[number - 2] if number > 1 else 0)
        alone = not text[match.start() - column:match.start()].strip()
        if comment.startswith("/*"):
            lines = [re.sub(r"^\s*\*?", "", line).strip() for line in comment[2:-2].split("\n")]
            block = Text(number, lines[0], comment.startswith("/**"))
            block.lines = lines
            found.append(block)
            last = None
            continue
        mark = re.match(r"///?<?", comment)[0]
        line = comment[len(mark):].strip()
        doc = mark.startswith("///") or (alone and mark == doc_mark)
        if alone and last == (number - 1, column) and found[-1].doc == doc and line:
            found[-1].lines.append(line)
        else:
            found.append(Text(number, line, doc))
        last = (number, column) if line else None
    return found


def without_comments(text):
    """C++ code alone."""
    return C_TOKEN.sub(lambda match: " " if match["comment"] else match[0], text)


def python_comments(text):
    """Texts of the comments and docstrings of Python."""
    found, last = [], None
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type != tokenize.COMMENT:
            continue
        line, alone = token.string.lstrip("#:! "), not token.line[:token.start[1]].strip()
        if alone and last == (token.start[0] - 1, token.start[1]):
            found[-1].lines.append(line)
        else:
            found.append(Text(token.start[0], line))
        last = token.start
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)) and ast.get_docstring(node):
            first = node.body[0].value
            paragraph = None
            for offset, line in enumerate(first.value.split("\n")):
                line = line.strip()
                if not line:
                    paragraph = None
                elif paragraph is None:
                    paragraph = Text(first.lineno + offset, line, offset == 0)
                    found.append(paragraph)
                else:
                    paragraph.lines.append(line)
    return found


def page_paragraphs(text):
    """Paragraphs, items and cells of a Markdown page. Its headings are anchors of links, and may be questions."""
    found, last = [], None
    for number, line in check_links.prose_lines(text):
        stripped = line.strip()
        if stripped.startswith("|"):
            found += [Text(number, cell.strip()) for cell in stripped.strip("|").split("|")]
            last = None
        elif not stripped or stripped.startswith("#"):
            last = None
        elif last == number - 1 and not re.match(r"[-*>]|\d+\. ", stripped):
            found[-1].lines.append(stripped)
            last = number
        else:
            found.append(Text(number, re.sub(r"^(?:[-*>]+|\d+\.) ", "", stripped)))
            last = number
    return found


READERS = {
    ".h": c_comments,
    ".cpp": c_comments,
    ".js": c_comments,
    ".proto": lambda text: c_comments(text, "//"),
    ".py": python_comments,
    ".md": page_paragraphs,
}
