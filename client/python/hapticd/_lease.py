"""Exclusive control of a rig, renewed by a process of its own.

A caller that computes for minutes, or holds Python's interpreter, keeps its lease; one that ends, or is killed, does not:
the renewal ends with it, and the lease expires as it was agreed (docs/access.md).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from hapticd._connection import Endpoint


class Renewal:
    """Renews the lease of `token` until stop(), or until this process is no more."""

    def __init__(self, endpoint: Endpoint, token: str, ttl_s: float) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "hapticd._lease_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            # An interrupt from the keyboard is for the program, which then returns the lease.
            start_new_session=True,
            env=_environment(),
        )
        order = {
            "address": endpoint.address,
            "certificates": str(endpoint.certificates) if endpoint.certificates else None,
            "token": token,
            "ttl_s": ttl_s,
        }
        assert self._process.stdin is not None
        # Not as an argument: those of a process can be read by every user of the machine.
        self._process.stdin.write(json.dumps(order).encode() + b"\n")
        self._process.stdin.flush()

    @property
    def process_id(self) -> int:
        return self._process.pid

    def stop(self) -> None:
        if self._process.stdin is not None and not self._process.stdin.closed:
            try:
                self._process.stdin.close()
            except BrokenPipeError:  # it has ended: the lease was lost
                pass
        try:
            self._process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _environment() -> dict[str, str]:
    """That of this process, and where this package is."""
    environment = dict(os.environ)
    package = str(Path(__file__).resolve().parents[1])
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, [package, environment.get("PYTHONPATH")]))
    return environment
