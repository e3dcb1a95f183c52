"""The client as programs use it, against a daemon."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
import struct
import subprocess
import sys
import threading
import time
import zipfile
from pathlib import Path
from typing import Any, Callable

import grpc
import numpy as np
import pytest
from daemon import BINARIES
from relay import Relay

import hapticd
import hapticd.aio
from hapticd import _stop
from hapticd._calls import TABLE, AsyncCalls, Calls
from hapticd._connection import Endpoint
from hapticd.v1 import rig_pb2, telemetry_pb2

ROOT = Path(__file__).resolve().parents[2]

# A lease, and a caller that does nothing for longer than it lives.
TTL_S = 2.0
BLOCKED_S = 2.6

# Without an argument these wait, or need one that says what of.
ARGUMENTS: dict[str, dict[str, Any]] = {"set_target": {"stiffness_n_per_mm": 0.3}, "load_scene": {"name": "tap_1d"}}


def methods_of_the_contract() -> list[str]:
    """Names from the descriptors of the messages' modules, not from the table."""
    import hapticd.v1 as package

    names = []
    for file in Path(package.__file__).parent.glob("*_pb2.py"):
        module = __import__(f"hapticd.v1.{file.stem}", fromlist=["DESCRIPTOR"])
        for service in module.DESCRIPTOR.services_by_name.values():
            names += [f"{service.name}/{method.name}" for method in service.methods]
    return sorted(names)


def test_the_table_has_every_call() -> None:
    assert sorted(TABLE) == methods_of_the_contract()
    for call in TABLE.values():
        assert hasattr(Calls, call.python_name) and hasattr(AsyncCalls, call.python_name), call.name


@pytest.mark.parametrize("name", methods_of_the_contract())
def test_every_call_reaches_the_daemon(rig: hapticd.Rig, name: str) -> None:
    call = TABLE[name]
    method = getattr(rig, call.python_name)
    try:
        if name in ("IdentificationService/UploadRecording", "CalibrationService/PushReferencePoses"):
            method(iter([]), deadline_s=5)
            return
        answer = method(**ARGUMENTS.get(call.python_name, {}))
        if token := getattr(answer, "token", ""):  # others want the lease, too
            with hapticd.connect(rig.address, lease_token=token) as holder:
                holder.return_lease()
        if not isinstance(answer, call.response):
            with answer as stream:
                assert isinstance(next(stream), call.response)
    except hapticd.Refused as refused:  # in its present state; but it knows the call
        assert refused.code != "UNIMPLEMENTED" and refused.reason, name


def test_refusals_have_their_parts(rig: hapticd.Rig) -> None:
    rig.load_scene("tap_1d")
    with pytest.raises(hapticd.Refused) as raised:
        rig.set_target(2000.0)
    error = raised.value
    assert (error.reason, error.code) == ("OUT_OF_RANGE", "OUT_OF_RANGE")
    assert error.where == "SetTargetRequest.stiffness_n_per_mm"
    assert "1000" in error.limit and "2000" in error.value
    assert str(error).startswith(error.where)


def test_refusals_are_typed(rig: hapticd.Rig) -> None:
    rig.load_scene("tap_1d")
    rig.stop("test")
    with pytest.raises(hapticd.Stopped):
        rig.move_tool(point_mm=(0, 0, 30)).last()
    rig.clear()
    with rig.lease("the first"):
        with hapticd.connect(rig.address) as other, pytest.raises(hapticd.NotAllowed) as raised:
            other.set_target(0.3)
    assert raised.value.reason == "LEASE_HELD" and "the first" in str(raised.value)


@pytest.mark.parametrize(
    ("arguments", "where"),
    [
        ({"program": {"kind": "jump"}}, "SetHandProgramRequest.program.kind"),
        ({"program": {"kine": 1}}, "SetHandProgramRequest.program.kine"),
        ({"program": {"force_n": "much"}}, "SetHandProgramRequest.program.force_n"),
        ({"program": {"repetitions": 1.5}}, "SetHandProgramRequest.program.repetitions"),
        ({"program": {"stroke_direction": (1, 2)}}, "SetHandProgramRequest.program.stroke_direction"),
        ({"program": 7}, "SetHandProgramRequest.program"),
    ],
)
def test_a_wrong_argument_names_its_place(rig: hapticd.Rig, arguments: dict[str, Any], where: str) -> None:
    with pytest.raises(hapticd.BadArgument) as raised:
        rig.set_hand_program(**arguments)
    assert raised.value.where == where


@pytest.mark.parametrize("address", ["lab1", "host:0", "host:99999", ":50051", "unix:", "a b:1"])
def test_a_wrong_address_is_refused(address: str) -> None:
    with pytest.raises(hapticd.BadArgument):
        hapticd.connect(address)


def test_no_daemon_and_a_dead_one_are_unreachable(start_daemon: Any) -> None:
    daemon = start_daemon()
    with hapticd.connect(daemon.address) as rig:
        rig.get_rig_info()
        daemon.end(9)
        with pytest.raises(hapticd.Unreachable):
            rig.get_rig_info()
    with pytest.raises(hapticd.Unreachable):
        hapticd.connect(daemon.address)


def test_no_certificate_says_where_it_looked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HAPTICD_CERTIFICATES", str(tmp_path))
    with pytest.raises(hapticd.BadArgument) as raised:
        hapticd.connect("lab1:50051")
    assert str(tmp_path) in str(raised.value)


@pytest.fixture
def lab(tmp_path: Path, start_daemon: Any) -> Any:
    """A daemon that listens in all three ways: its plain, encrypted and local address, and a folder of certificates."""
    made = tmp_path / "made"
    subprocess.run(
        ["bash", ROOT / "deploy/make_certificates.sh", "--lab", "test", "--out", made]
        + ["--server", "rig,127.0.0.1", "--client", "operator/anna"],
        check=True,
        capture_output=True,
    )
    config = tmp_path / "hapticd.toml"
    config.write_text(
        f'[network]\nlisten_tls = "127.0.0.1:0"\ncertificates = "{made / "servers/rig"}"\n[rig.sim]\nspeed = 5.0\n'
    )
    local = tmp_path / "d.sock"
    daemon = start_daemon("--model-store", ":memory:", "--config", str(config), "--unix", str(local))
    secured = daemon.await_log(r"with certificates, on (\S+)\s")
    return {"plain": daemon.address, "tls": f"tls:{secured}", "unix": f"unix:{local}", "certificates": str(made / "clients/anna")}


def test_certificates_show_who_it_is(lab: Any) -> None:
    with hapticd.connect(lab["tls"], certificates=lab["certificates"]) as rig:
        assert rig.get_access().identity == "spiffe://test/hapticd/operator/anna"
        with rig.lease("with a certificate", ttl_s=TTL_S):
            time.sleep(BLOCKED_S)
            rig.load_scene("tap_1d")


def test_an_authority_makes_certificates_of_its_own_lab_only(tmp_path: Path) -> None:
    def make(lab: str, *names: str) -> Any:
        command = ["bash", ROOT / "deploy/make_certificates.sh", "--lab", lab, "--out", tmp_path / "made", *names]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    assert make("optics", "--server", "rig").returncode == 0
    refused = make("optic", "--client", "operator/anna")
    assert refused.returncode == 2 and not list((tmp_path / "made/clients").iterdir())
    assert refused.stderr == (
        f"make_certificates.sh: --lab optic: the authority in {tmp_path}/made/authority is that of lab optics: "
        "name --lab optics, or another --out for lab optic\n"
    )
    assert make("optics", "--client", "operator/anna").returncode == 0
    assert (tmp_path / "made/clients/anna/client.crt").exists()


def test_a_port_that_is_spoken_to_in_the_wrong_way_is_named(lab: Any) -> None:
    """Tests both clients, and with an address that works."""
    encrypted, plain = lab["tls"].removeprefix("tls:"), lab["plain"]
    for address, problem, remedy in [
        (encrypted, "this port expects certificates", f"tls:{encrypted}"),
        (f"tls:{plain}", "this port speaks without certificates", "listen_tls"),
    ]:
        with pytest.raises(hapticd.Unreachable) as raised:
            hapticd.connect(address, certificates=lab["certificates"])
        assert problem in raised.value.what and remedy in raised.value.remedy
        with pytest.raises(hapticd.Unreachable, match=problem):
            asyncio.run(hapticd.aio.connect(address, certificates=lab["certificates"]))
        ended = hapticctl("--server", address, "--certificates", lab["certificates"], "status")
        assert ended.returncode == 3 and problem in ended.stderr and remedy in ended.stderr


def hapticctl(*arguments: str) -> Any:
    return subprocess.run([BINARIES / "hapticctl", *arguments], capture_output=True, text=True, check=False)


#: Each runs until it is ended, and receives nothing if nothing happens.
WATCHERS = [
    ["telemetry", "watch"],
    ["telemetry", "record", "rows.csv"],
    ["pose", "watch"],
    ["log", "--follow"],
    ["lease", "watch"],
    ["lease", "hold", "--", "sleep", "100"],
]
DARK_LIMIT_S = 15.0


def test_a_network_that_goes_dark_is_noticed(start_daemon: Any, tmp_path: Path) -> None:
    """Tests every program that only listens: exit code 3."""
    relay = Relay(start_daemon().address)
    with contextlib.ExitStack() as ending:
        ending.callback(relay.end)
        watchers = {}
        for words in WATCHERS:
            log = ending.enter_context((tmp_path / "_".join(words[:2])).open("w+"))
            watchers[" ".join(words)] = (subprocess.Popen(
                [BINARIES / "hapticctl", "--server", relay.address, *words], cwd=tmp_path, stdout=log, stderr=subprocess.STDOUT
            ), log)
            ending.callback(watchers[" ".join(words)][0].kill)
        rig = ending.enter_context(hapticd.connect(relay.address))
        with rig.telemetry() as blocks, rig.watch_lease() as changes:
            next(iter(blocks))
            while not next(changes).HasField("lease"):  # of lease hold, which starts last
                pass
            time.sleep(1.0)  # for the last ones to connect; they would fail otherwise, in the same way
            relay.go_dark()
            dark_since_s = time.monotonic()
            with pytest.raises(hapticd.Unreachable):
                for _ in changes:
                    pass
            with pytest.raises(hapticd.Unreachable):
                for _ in blocks:
                    pass
        for words, (process, log) in watchers.items():
            assert process.wait(timeout=2.0 * DARK_LIMIT_S) == 3, words
            log.seek(0)
            assert "hapticctl: " in log.read(), words
        assert time.monotonic() - dark_since_s < 2.0 * DARK_LIMIT_S


def test_a_quiet_stream_of_a_client_that_asks_often_stays(start_daemon: Any) -> None:
    """gRPC's own bound would end it with the fourth question; here each 5 s are allowed, also without a call."""
    options = [
        ("grpc.keepalive_time_ms", 5_100),
        ("grpc.keepalive_timeout_ms", 5_000),
        ("grpc.keepalive_permit_without_calls", 1),
        ("grpc.http2.max_pings_without_data", 0),
    ]
    with grpc.insecure_channel(start_daemon().address, options) as channel:
        watch = channel.unary_stream(
            "/hapticd.v1.LeaseService/WatchLease", request_serializer=bytes, response_deserializer=bytes
        )
        with pytest.raises(grpc.RpcError) as raised:
            for _ in watch(b"", timeout=27.0):
                pass
        assert raised.value.code() == grpc.StatusCode.DEADLINE_EXCEEDED, raised.value.details()


def hold_the_interpreter(seconds: float) -> None:
    """No other thread of this process runs meanwhile."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1000.0)
    try:
        end = time.perf_counter() + seconds
        while time.perf_counter() < end:
            pass
    finally:
        sys.setswitchinterval(before)


@pytest.mark.parametrize("keep_busy", [time.sleep, hold_the_interpreter])
def test_the_lease_survives_a_caller_that_blocks(rig: hapticd.Rig, keep_busy: Any) -> None:
    rig.load_scene("tap_1d")
    with rig.lease("long computation", ttl_s=TTL_S) as lease:
        keep_busy(BLOCKED_S)
        rig.set_target(0.3)  # raises if it expired meanwhile
        assert rig.get_lease().lease.number == lease.number
    assert not rig.get_lease().HasField("lease")


def test_a_lease_does_not_begin_before_the_process_that_renews_it(rig: hapticd.Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sitecustomize.py").write_text("import time\ntime.sleep(1.5)\n")  # every interpreter starts so slowly
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join((str(tmp_path), os.environ.get("PYTHONPATH", ""))))
    rig.load_scene("tap_1d")
    with rig.lease("on a busy machine", ttl_s=1.0) as lease:
        time.sleep(1.3)  # longer than the lease lives
        assert rig.get_lease().lease.number == lease.number


def test_a_renewal_that_cannot_start_is_said(rig: hapticd.Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(hapticd.HapticdError, match="did not start"), rig.lease("without a renewal"):
        pass
    assert not rig.get_lease().HasField("lease")


def test_a_lease_that_was_taken_is_lost(start_daemon: Any, tmp_path: Path) -> None:
    (tmp_path / "hapticd.toml").write_text("[access]\ntake_notice_s = 0.2\n")
    daemon = start_daemon("--model-store", ":memory:", "--config", str(tmp_path / "hapticd.toml"))
    with hapticd.connect(daemon.address) as rig, rig.lease("the first"):
        rig.load_scene("tap_1d")
        with hapticd.connect(rig.address) as other, other.lease("the second", take="mine now"):
            with pytest.raises(hapticd.LeaseLost):
                rig.set_target(0.3)


def test_a_killed_program_loses_its_lease(rig: hapticd.Rig) -> None:
    program = (
        "import hapticd, os, signal\n"
        f"rig = hapticd.connect({rig.address!r})\n"
        "with rig.lease('doomed', ttl_s=1.0):\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    assert subprocess.run([sys.executable, "-c", program], env=os.environ, check=False).returncode == -9
    with rig.watch_lease() as changes:
        for state in changes:
            if not state.HasField("lease"):
                break
    with rig.lease("the next"):
        pass


def test_the_simulated_hand_is_waited_for(start_daemon: Callable[..., Any]) -> None:
    daemon = start_daemon("--scene", "tap_1d")
    with hapticd.connect(daemon.address) as rig:
        press = {"kind": "press", "force_n": 1.0, "force_rate_n_per_s": 10.0, "hold_s": 0.2}
        data = rig.read_hand(press, ["contact"])
        assert data["contact_in_contact"].any() and not data["contact_in_contact"][-1]
        assert rig.get_simulation().hand_is_done
        rig.set_hand_program(press)
        assert not rig.get_simulation().hand_is_done
        rig.wait_for_hand()
        assert not rig.get_rig_state().in_contact
        with pytest.raises(hapticd.TimedOut, match="has not ended its program"):
            rig.read_hand({**press, "hold_s": -1.0}, ["contact"], timeout_s=2.0)
        with pytest.raises(hapticd.TimedOut, match="longer timeout_s"):
            rig.wait_for_hand(0.1)

    async def waits() -> None:
        async with await hapticd.aio.connect(daemon.address) as rig:
            await rig.set_hand_program({"kind": "rest"})
            await rig.wait_for_hand()

    asyncio.run(waits())


def test_telemetry_comes_as_columns(rig: hapticd.Rig) -> None:
    rig.load_scene("tap_1d")
    rig.set_hand_program({"kind": "press", "force_n": 3.0})
    data = rig.read(1.0, ["contact", "truth", "deformation"])
    assert len(data) == 1000 and data.lost == 0
    assert (data.ticks[1:] - data.ticks[:-1] == 1).all()
    assert data.unit("contact_reaction_force_n") == "N" and data.unit("tick") == "1"
    assert data.vector("truth_tip_position_mm").shape == (1000, 3)
    with pytest.raises(hapticd.BadArgument) as raised:
        data["contact_force_n"]
    assert "contact_reaction_force_n" in str(raised.value)
    some = data.between(int(data.ticks[10]), int(data.ticks[19]))
    assert len(some) == 10
    frame = data.to_pandas()
    assert frame.index.name == "tick" and frame.attrs["units"]["contact_reaction_force_n"] == "N"
    assert len(data.plot().axes) >= 2


def test_a_lower_rate_is_every_nth_tick(rig: hapticd.Rig) -> None:
    rig.load_scene("tap_1d")
    data = rig.read(0.5, ["contact"], hz=90.0)
    assert (data.ticks[1:] - data.ticks[:-1] == 12).all()  # 83.3 Hz: not more than asked
    with pytest.raises(hapticd.BadArgument):
        rig.telemetry(hz=0.0)


@pytest.mark.parametrize("wrong", ["1", None, float("nan")])
def test_what_is_no_number_of_seconds_is_named(rig: hapticd.Rig, wrong: Any) -> None:
    with pytest.raises(hapticd.BadArgument, match=r"^read\(seconds\): this is not a number \(got .+\); accepted: a finite number of seconds"):
        rig.read(wrong)
    with rig.telemetry(["contact"]) as stream, pytest.raises(hapticd.BadArgument, match=r"take\(seconds\)"):
        stream.take(wrong)
    if wrong is not None:
        with pytest.raises(hapticd.BadArgument, match=r"telemetry\(hz\)"):
            rig.read(1.0, hz=wrong)
    assert len(rig.read(np.float32(0.1), hz=np.int64(100)))  # numbers of numpy are some


def test_what_is_lost_is_counted_where_it_was_lost() -> None:
    column = telemetry_pb2.TelemetryColumn(name="tick", unit="1", type=telemetry_pb2.COLUMN_TYPE_INT64)
    batches = [
        telemetry_pb2.TelemetryBatch(
            dropped_by_subscriber=by_subscriber,
            dropped_by_server=by_server,
            block=telemetry_pb2.TelemetryBlock(columns=columns, rows=np.array(ticks, dtype="<i8").tobytes()),
        )
        for ticks, by_subscriber, by_server, columns in (([1, 2], 0, 0, [column]), ([6, 7], 3, 0, []), ([9], 3, 1, []), ([10], 3, 1, []))
    ]
    stream: Any = iter(batches)
    blocks = list(hapticd.Telemetry(stream, 1000.0))
    assert [block.lost for block in blocks] == [0, 3, 1, 0]
    assert [list(block.ticks) for block in blocks] == [[1, 2], [6, 7], [9], [10]]
    # What is lost counts as time that has passed.
    taken = hapticd.Telemetry(iter(batches), 1000.0).take_samples(6)  # type: ignore[arg-type]
    assert (len(taken), taken.lost) == (3, 3)


def chunk_ends(content: bytes) -> list[int]:
    """Offsets at which the chunks of an MCAP file end."""
    found, at = [], 8
    while at + 9 <= len(content):
        code, size = struct.unpack_from("<BQ", content, at)
        at += 9 + size
        if code == 0x06:
            found.append(at)
        elif code == 0x0F:  # the end of the data
            break
    return found


def test_recordings_open_alike(start_daemon: Any, tmp_path: Path) -> None:
    daemon = start_daemon("--model-store", str(tmp_path / "models.sqlite"))
    with hapticd.connect(daemon.address) as rig:
        # Before there is a scene: a busy machine makes incidents.
        with pytest.raises(hapticd.Refused, match="there is none yet"):
            rig.download_recording(tmp_path / "no.mcap", "last", kind="incident")
        rig.load_scene("tap_1d")
        made = rig.start_recording("pytest", note="a note")
        rig.read(0.5, ["contact"])
        rig.annotate_recording("here")
        rig.set_target(0.25)
        rig.load_scene("wall")
        rig.read(0.3, ["contact"])
        made = rig.stop_recording()
        paths = [rig.download_recording(tmp_path / name, made.id) for name in ("a.mcap", "a.h5")]
        uploaded = rig.upload_recording_file(tmp_path / "a.mcap")
        assert uploaded.rows == made.rows
        assert rig.download_recording(tmp_path / "last.mcap", "last").read_bytes() == paths[0].read_bytes()
        with pytest.raises(hapticd.Refused):
            rig.download_recording(tmp_path / "no.mcap", "20200101T000000Z_none")
        assert not list(tmp_path.glob("no.mcap*"))
    one, other = (hapticd.open_recording(path) for path in paths)
    assert len(one.data) == len(other.data) == made.rows
    for recording in (one, other):
        assert recording.damage == ""
        assert [event.text for event in recording.events if event.kind == "annotation"] == ["here"]
        assert recording.data.unit("contact_reaction_force_n") == "N"
        assert recording.metadata["scene"]["name"] == "wall"
    assert {name: set(keys) for name, keys in one.metadata.items()} == {name: set(keys) for name, keys in other.metadata.items()}
    assert one.metadata["scene"] == other.metadata["scene"] and one.metadata["configuration"] == other.metadata["configuration"]
    common = set(one.data.names) & set(other.data.names)
    assert "contact_reaction_force_n" in common
    for name in common:
        first, second = one.data[name], other.data[name]
        assert ((first == second) | ((first != first) & (second != second))).all(), name

    whole = paths[0].read_bytes()
    ends = chunk_ends(whole)
    assert len(ends) >= 2
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: ends[0] + 20])
    part = hapticd.open_recording(cut)
    assert part.damage and 0 < len(part.data) < len(one.data)
    broken = bytearray(whole)
    broken[ends[1] - 10] ^= 0xFF  # in the second chunk
    cut.write_bytes(broken)
    part = hapticd.open_recording(cut)
    assert part.damage and 0 < len(part.data) < len(one.data)
    for junk in (b"", b"\x89MCAP0\r\n", b"tick,time_s\n", whole[:100]):
        cut.write_bytes(junk)
        with pytest.raises(hapticd.BadFile):
            hapticd.open_recording(cut)


def test_asyncio_has_the_same(shared_daemon: Any) -> None:
    async def session() -> None:
        async with await hapticd.aio.connect(shared_daemon.address) as rig:
            await rig.load_scene("tap_1d")
            async with rig.lease("asyncio", ttl_s=TTL_S):
                time.sleep(BLOCKED_S)  # a blocked event loop
                assert (await rig.set_target(0.3)).granted_n_per_mm == pytest.approx(0.3)
            ticks = 0
            async with await rig.telemetry(["contact"]) as stream:
                async for block in stream:
                    ticks += len(block)
                    if ticks > 300:
                        break
            with pytest.raises(hapticd.Refused) as raised:
                await rig.load_scene("no such scene")
            assert raised.value.reason == "NOT_FOUND"
            info: rig_pb2.RigInfo = await rig.get_rig_info()
            assert info.has_truth

    asyncio.run(session())


def test_calls_of_several_threads_do_not_wait_for_one_another(rig: hapticd.Rig) -> None:
    rig.load_scene("tap_1d")
    answers: list[int] = []
    waiting = rig.watch_lease()
    next(waiting)
    threads = [threading.Thread(target=lambda: answers.append(rig.get_rig_state().tick)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    waiting.cancel()
    assert len(answers) == 8


@pytest.mark.parametrize(
    ("example", "arguments"), [("lab_control", ["0.5"]), ("automated_rig", []), ("visual_ar", ["20"])]
)
@pytest.mark.parametrize("way", ["plain", "tls", "unix"])
def test_the_examples_run(lab: Any, tmp_path: Path, example: str, arguments: list[str], way: str) -> None:
    program = ROOT / "client/python/examples" / f"{example}.py"
    ended = subprocess.run(
        [sys.executable, program, lab[way], *arguments], cwd=tmp_path, capture_output=True, text=True, check=False,
        env={**os.environ, "HAPTICD_CERTIFICATES": lab["certificates"]},
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert ended.stdout


@pytest.mark.parametrize("when", ["before", "meanwhile"])
@pytest.mark.parametrize("language", ["Python", "C++"])
def test_the_automated_rig_says_that_the_guard_is_latched(lab: Any, language: str, when: str) -> None:
    example = {
        "Python": [sys.executable, "-u", ROOT / "client/python/examples/automated_rig.py"],
        "C++": ["stdbuf", "--output=L", BINARIES / "automated_rig"],
    }
    program = [*example[language], lab["plain"]]
    with hapticd.connect(lab["plain"]) as rig:
        if when == "before":
            rig.stop("a test")
        with subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
            assert run.stdout and run.stderr
            if when == "meanwhile":
                assert "felt" in run.stdout.readline()
                rig.stop("a test")
            shown, error = run.stdout.read(), run.stderr.read()
        rig.clear()
    assert run.returncode == 1 and "felt" not in shown, shown
    assert "the guard is latched (" in error and "STOPPED)" in error and "hapticctl clear" in error


def test_a_wheel_is_made_and_imported(tmp_path: Path) -> None:
    source = Path(hapticd.__file__).resolve().parents[1]
    tree = tmp_path / "tree"
    shutil.copytree(source, tree, ignore=shutil.ignore_patterns("__pycache__", "build", "*.egg-info"))
    make = "import setuptools.build_meta as backend; print(backend.build_wheel('.'))"
    subprocess.run([sys.executable, "-c", make], cwd=tree, check=True, capture_output=True)
    (wheel,) = tree.glob("*.whl")
    place = tmp_path / "installed"
    zipfile.ZipFile(wheel).extractall(place)
    assert (place / "hapticd/py.typed").exists() and (place / "hapticd/experiment/protocols/stiffness_1d.toml").exists()
    look = "import hapticd, hapticd.experiment.protocol as p; print(hapticd.__file__, p.read('stiffness_1d').name)"
    ended = subprocess.run(
        [sys.executable, "-c", look], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(place)}, capture_output=True, text=True, check=True
    )
    assert str(place) in ended.stdout


def test_a_stop_goes_by_two_paths(rig: hapticd.Rig) -> None:
    for outcome in (hapticd.stop("enough", address=rig.address), rig.stop_by_both("enough")):
        assert outcome.first in ("stop_port", "service") and outcome.both_answered
        assert outcome.answer.guard_state == rig_pb2.GUARD_STATE_LATCHED
        assert 0.0 < outcome.after_s < 60.0
        rig.clear()
    assert rig.stop("enough").guard_fault == rig_pb2.GUARD_FAULT_STOPPED
    rig.clear()


def test_a_stop_needs_no_call(start_daemon: Any, tmp_path: Path) -> None:
    daemon = start_daemon("--model-store", ":memory:", "--unix", str(tmp_path / "sock"))
    for address in (daemon.address, f"unix:{tmp_path / 'sock'}"):
        assert _stop.stop_by_port(Endpoint.of(address, None), 5.0) >= 0
    with hapticd.connect(daemon.address) as rig:
        assert rig.get_rig_state().guard_state == rig_pb2.GUARD_STATE_LATCHED


def test_a_stop_without_a_daemon_says_where_none_is() -> None:
    with pytest.raises(hapticd.Unreachable) as caught:
        hapticd.stop(address="127.0.0.1:1", timeout_s=2.0)
    assert caught.value.where == "127.0.0.1:2"


def test_a_channel_that_waits_for_ever_is_left() -> None:
    class Channel:
        is_asked = False

        def close(self) -> None:
            self.is_asked = True
            threading.Event().wait()

    channel = Channel()
    rig = hapticd.Rig(Endpoint.of("127.0.0.1:1", None), channel, 1.0, "")  # type: ignore[arg-type]
    rig.close()
    assert channel.is_asked
