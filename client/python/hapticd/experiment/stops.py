"""Rules by which a procedure ends, as data: {any_of = [{reversals = 15}, {trials = 80}]}."""

from __future__ import annotations

from typing import Any, Mapping

from hapticd.errors import BadFile

Rule = Mapping[str, Any]


def check(rule: Rule, known: Mapping[str, int], where: str) -> None:
    """Raises BadFile if the rule is none. `known`: what is counted; its values are not used."""
    if len(rule) != 1:
        raise BadFile("a stop rule has one key", where=where, value=", ".join(rule), limit="any_of, all_of, " + ", ".join(known))
    ((name, value),) = rule.items()
    if name in ("any_of", "all_of"):
        if not isinstance(value, list) or not value:
            raise BadFile("a list of rules is needed", where=f"{where}.{name}", value=repr(value))
        for index, one in enumerate(value):
            if not isinstance(one, Mapping):
                raise BadFile("a rule is needed", where=f"{where}.{name}[{index}]", value=repr(one))
            check(one, known, f"{where}.{name}[{index}]")
    elif name not in known:
        raise BadFile("unknown key", where=where, value=name, limit="any_of, all_of, " + ", ".join(known))
    elif isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= 10000:
        raise BadFile("the count is out of range", where=f"{where}.{name}", value=repr(value), limit="1 … 10000")


def is_met(rule: Rule, counts: Mapping[str, int]) -> bool:
    ((name, value),) = rule.items()
    if name == "any_of":
        return any(is_met(one, counts) for one in value)
    if name == "all_of":
        return all(is_met(one, counts) for one in value)
    return counts[name] >= int(value)
