"""Stops by every path while the daemon is kept busy: a large recording that is read, a locked store, a stopped console."""

from __future__ import annotations

import contextlib
import os
import signal
import sqlite3
import subprocess
import threading
import time
from pathlib import Path
from typing import Any, Callable, Iterator

import pytest

import hapticd
from console_attack_test import Socket, lab_of
from console_page import Visitor
from daemon import BINARIES
from hapticd.v1 import identification_pb2, rig_pb2

#: Size of the recording, in megabytes. What is read for as long as a person would wait has 500.
UPLOAD_MB = int(os.environ.get("HAPTICD_UPLOAD_MB", "50"))
MAX_GROWTH_MB = 100
PATIENCE_S = 60.0


class Rig:
    """A daemon that listens by every transport, with a store of models on the disk."""

    def __init__(self, folder: Path, start_daemon: Any) -> None:
        made = lab_of(folder, "operator/anna")
        self.store = folder / "models.sqlite"
        config = folder / "rig.toml"
        config.write_text(f'[network]\nlisten_tls = "127.0.0.1:0"\ncertificates = "{made / "servers/rig"}"\n'
                          f'[recording]\nfolder = "{folder / "recordings"}"\n')  # fmt: skip
        (folder / "recordings").mkdir()
        local = folder / "d.sock"
        self.daemon = start_daemon("--scene", "tap_1d", "--model-store", str(self.store), "--config", str(config), "--unix", str(local))
        tls = self.daemon.await_log(r"with certificates, on (\S+)\s")
        self.address: str = self.daemon.address
        self.certificates = str(made / "clients/anna")
        self.addresses = (self.address, f"unix:{local}", f"tls:{tls}")

    def connect(self, address: str = "") -> hapticd.Rig:
        return hapticd.connect(address or self.address, certificates=self.certificates)

    def resident_mb(self) -> float:
        status = Path(f"/proc/{self.daemon.process.pid}/status").read_text()
        return int(status.split("VmRSS:")[1].split()[0]) / 1000

    def expect_latched_and_clear(self, how: str) -> None:
        with self.connect() as rig:
            until = time.monotonic() + PATIENCE_S
            while rig.get_rig_state(without_histograms=True).guard_state != rig_pb2.GUARD_STATE_LATCHED:
                assert time.monotonic() < until, how
            rig.clear()

    def stop_by_every_path(self) -> list[float]:
        """Stops also by new connections, and by a signal; returns when each stop had come."""
        came = []
        for address in self.addresses:
            with self.connect(address) as rig:
                for outcome in (rig.stop_by_both("attack"), hapticd.stop("attack", address=address, certificates=self.certificates)):
                    came.append(time.monotonic())
                    assert outcome.both_answered, (address, outcome)
            self.expect_latched_and_clear(address)
        os.kill(self.daemon.process.pid, signal.SIGUSR1)
        self.expect_latched_and_clear("SIGUSR1")
        return came


@pytest.fixture
def rig(start_daemon: Any, tmp_path: Path) -> Rig:
    return Rig(tmp_path, start_daemon)


class Calls:
    """Calls of one kind, one after the other in separate threads; when each began and ended."""

    def __init__(self, rig: Rig, call: Callable[[hapticd.Rig], Any], threads: int) -> None:
        self.times: list[tuple[float, float]] = []
        self._done = threading.Event()
        self._threads = [threading.Thread(target=self._run, args=(rig, call)) for _ in range(threads)]

    def _run(self, rig: Rig, call: Callable[[hapticd.Rig], Any]) -> None:
        with rig.connect() as own:
            while not self._done.is_set():
                began = time.monotonic()
                with contextlib.suppress(hapticd.HapticdError):
                    call(own)
                self.times.append((began, time.monotonic()))

    def __enter__(self) -> Calls:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: Any) -> None:
        self._done.set()
        for thread in self._threads:
            thread.join()

    def overlap(self, moments: list[float]) -> int:
        """How many of these moments lie within a call."""
        return sum(any(began < moment < ended for began, ended in self.times) for moment in moments)


def rows(megabytes: int) -> Iterator[identification_pb2.UploadRecordingRequest]:
    yield identification_pb2.UploadRecordingRequest(description={"name": "attack.csv"}, csv=b"time_s,force_N,position_mm\n")
    block = "".join(f"%d.{i:03d},{1e-3 * i:.4f},{1e-2 * i:.4f}\n" for i in range(1000))
    for second in range(megabytes * 1_000_000 // (22 * 8000)):
        text = "".join(block.replace("%d", str(8 * second + part)) for part in range(8))
        yield identification_pb2.UploadRecordingRequest(csv=text.encode())


def test_while_a_large_recording_is_sent_and_read(rig: Rig) -> None:
    before_mb = rig.resident_mb()
    with rig.connect() as sender:
        uploads: list[str] = []
        sending = threading.Thread(target=lambda: uploads.append(sender.upload_recording(rows(UPLOAD_MB), deadline_s=600.0).recording))
        sending.start()
        while sending.is_alive():
            rig.stop_by_every_path()
        sending.join()

        def read(own: hapticd.Rig) -> None:
            own.start_identification(object="attack", recording=uploads[0], contact={}, deadline_s=600.0)

        with Calls(rig, read, threads=2) as reading:
            came = [moment for _ in range(3) for moment in rig.stop_by_every_path()]
        assert reading.overlap(came) > 0
    assert rig.resident_mb() - before_mb < MAX_GROWTH_MB


def test_while_the_store_of_models_is_locked(rig: Rig) -> None:
    with contextlib.closing(sqlite3.connect(rig.store)) as other:
        other.execute("BEGIN EXCLUSIVE")
        with Calls(rig, lambda own: own.tag_stored_model(hash="a" * 64, tag="current", deadline_s=600.0), threads=4) as waiting:
            while not waiting.times and rig.daemon.process.poll() is None:  # each waits for seconds
                came = rig.stop_by_every_path()
        assert waiting.overlap(came) > 0


def test_of_a_client_that_may_start_no_further_thread(rig: Rig) -> None:
    for megabytes in (200, 300, 400):  # of addresses: room for a few stacks
        limited = ["prlimit", f"--as={megabytes}000000", BINARIES / "hapticctl", "--server", rig.address, "stop"]
        subprocess.run(limited, check=True, timeout=PATIENCE_S, capture_output=True)
        rig.expect_latched_and_clear(f"{megabytes} MB")


def test_while_a_console_stands_still(rig: Rig, start_console: Any) -> None:
    console = start_console()
    visitor = Visitor(rig.daemon, console)
    live = Socket(console.port, visitor.cookie)
    live.send(b'{"telemetry":1,"columns":["tick"],"max_rows":8192,"credits":4}')
    assert live.next_json()["id"] == 1
    before_mb = rig.resident_mb()
    console.process.send_signal(signal.SIGSTOP)
    try:
        for _ in range(5):
            rig.stop_by_every_path()
        with rig.connect() as own:
            assert own.get_rig_state(without_histograms=True).loop.running
        assert rig.resident_mb() - before_mb < MAX_GROWTH_MB
    finally:
        console.process.send_signal(signal.SIGCONT)
    assert visitor.rpc("SafetyService/Stop")[0] == 200, "it goes on"
    rig.expect_latched_and_clear("the console")
