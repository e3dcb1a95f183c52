"""Random numbers that depend on names, not on the order in which they are drawn.

What is drawn for a participant's third trial is the same whether the second was discarded, the program was killed in between,
or another participant came first.
"""

from __future__ import annotations

import hashlib
import json
from typing import Sequence, TypeVar, Union

import numpy as np

T = TypeVar("T")
Name = Union[str, int]


def generator(seed: int, *names: Name) -> np.random.Generator:
    """Philox with a key of SHA-256 over the seed and the names."""
    digest = hashlib.sha256(json.dumps([seed, *names]).encode()).digest()
    return np.random.Generator(np.random.Philox(key=int.from_bytes(digest[:16], "little")))


def shuffled(items: Sequence[T], seed: int, *names: Name) -> list[T]:
    return [items[index] for index in generator(seed, *names).permutation(len(items))]


def balanced_order(count: int, participant: int) -> list[int]:
    """Row of a Williams design for participant 0, 1, 2 …: over `count` participants (twice as many if it is odd) each
    condition is in each place, and behind each other one, equally often."""
    first = [0]
    for step in range(1, count):
        first.append((first[-1] + (step if step % 2 else -step)) % count)
    row = [(value + participant) % count for value in first]
    if count % 2 and participant // count % 2:
        row.reverse()
    return row
