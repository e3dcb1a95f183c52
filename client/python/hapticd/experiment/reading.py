"""Tables of a TOML file, strictly: every key known, every value of its type and in its range."""

from __future__ import annotations

import difflib
from typing import Any, Mapping, Optional, Sequence

from hapticd.errors import BadFile


class Table:
    """Reads keys one by one; done() refuses those that were not read."""

    def __init__(self, values: Mapping[str, Any], where: str) -> None:
        self._values = dict(values)
        self._known: list[str] = []
        self.where = where

    def _at(self, key: str) -> str:
        return f"{self.where} {key}" if self.where.endswith("]") else f"{self.where}: {key}"

    def has(self, key: str) -> bool:
        return key in self._values

    def take(self, key: str, default: Any = ...) -> Any:
        self._known.append(key)
        if key in self._values:
            return self._values.pop(key)
        if default is ...:
            near = difflib.get_close_matches(key, self._values, 1)
            raise BadFile("this key is missing", where=self._at(key), remedy=f"there is '{near[0]}': did you mean '{key}'?" if near else "")
        return default

    def text(self, key: str, default: Any = ..., *, limit: int = 4096) -> str:
        value = self.take(key, default)
        if not isinstance(value, str):
            raise BadFile("a text is needed", where=self._at(key), value=repr(value))
        if len(value) > limit:
            raise BadFile("the text is too long", where=self._at(key), value=f"{len(value)} characters", limit=f"{limit}")
        return value

    def word(self, key: str, words: Sequence[str], default: Any = ...) -> str:
        value = self.text(key, default)
        if value not in words:
            raise BadFile("unknown word", where=self._at(key), value=repr(value), limit=", ".join(words))
        return value

    def number(self, key: str, low: float, high: float, default: Any = ...) -> float:
        value = self.take(key, default)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise BadFile("a number is needed", where=self._at(key), value=repr(value), limit=f"{low:g} … {high:g}")
        if not low <= value <= high:
            raise BadFile("the number is out of range", where=self._at(key), value=f"{value:g}", limit=f"{low:g} … {high:g}")
        return float(value)

    def count(self, key: str, low: int, high: int, default: Any = ...) -> int:
        value = self.number(key, low, high, default)
        if value != int(value):
            raise BadFile("a whole number is needed", where=self._at(key), value=f"{value:g}")
        return int(value)

    def flag(self, key: str, default: Any = ...) -> bool:
        value = self.take(key, default)
        if not isinstance(value, bool):
            raise BadFile("true or false is needed", where=self._at(key), value=repr(value))
        return value

    def numbers(self, key: str, low: float, high: float, default: Any = ..., *, count: Optional[int] = None) -> tuple[float, ...]:
        value = self.take(key, default)
        if not isinstance(value, (list, tuple)) or (count is not None and len(value) != count) or not value:
            raise BadFile("a list of numbers is needed", where=self._at(key), value=repr(value), limit=f"{count or 'one or more'}")
        for one in value:
            if isinstance(one, bool) or not isinstance(one, (int, float)) or not low <= one <= high:
                raise BadFile("a number of the list is out of range", where=self._at(key), value=repr(one), limit=f"{low:g} … {high:g}")
        return tuple(float(one) for one in value)

    def texts(self, key: str) -> tuple[str, ...]:
        value = self.take(key)
        if not isinstance(value, list) or not value or not all(isinstance(one, str) and one for one in value):
            raise BadFile("a list of texts is needed", where=self._at(key), value=repr(value))
        return tuple(value)

    def table(self, key: str, *, needed: bool = False) -> Table:
        value = self.take(key) if needed else self.take(key, {})
        if not isinstance(value, Mapping):
            raise BadFile("a table is needed", where=self._at(key), value=repr(value))
        return Table(value, f"{self.where} [{key}]")

    def tables(self, key: str) -> list[Table]:
        value = self.take(key)
        if not isinstance(value, list) or not value or not all(isinstance(one, Mapping) for one in value):
            raise BadFile("one table or more is needed", where=self._at(key), limit=f"[[{key}]]")
        return [Table(one, f"{self.where} [[{key}]] {index + 1}") for index, one in enumerate(value)]

    def done(self) -> None:
        for key in self._values:
            near = difflib.get_close_matches(key, self._known, 1)
            raise BadFile(
                "unknown key",
                where=self._at(key),
                limit=", ".join(sorted(set(self._known))),
                remedy=f"did you mean '{near[0]}'?" if near else "remove it",
            )
