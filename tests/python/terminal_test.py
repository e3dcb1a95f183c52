"""What a terminal gets: nothing raw of what others wrote, neither from a daemon that is none nor from other clients; and answers
to what is typed, in words of the command line."""

from __future__ import annotations

import importlib
import os
import pkgutil
import pty
import re
import signal
import subprocess
import sys
import threading
import unicodedata
from concurrent import futures
from pathlib import Path
from typing import Any, Callable, Iterator

import grpc
import pytest
from google.protobuf import any_pb2, descriptor_pb2, symbol_database
from google.protobuf.descriptor import FieldDescriptor

import hapticd
import hapticd.v1
from daemon import BINARIES
from hapticd._shown import printable
from hapticd.v1 import common_pb2

EVIL = "\x1b]0;owned\x07\x1b[2J\x1b[31m\r\nforged line\x08\u009b2J\u0085\u202eabc\u2066\u2028\u200f\x7f`touch forged`"
MARKS = {0x61C, 0x200E, 0x200F, 0x2028, 0x2029, *range(0x202A, 0x202F), *range(0x2066, 0x206A)}
#: What hapticctl's own styles and live screens write.
OWN = re.compile(r"\x1b\[(?:0|1|9[0-6])m|\x1b\[\?(?:2026|25)[hl]|\x1b\[[KJ]|\x1b\[[0-9]+A")


def obeyed(text: str, allowed: str = "\n") -> list[str]:
    """The characters that a terminal would obey."""
    return [repr(c) for c in text if c not in allowed and (unicodedata.category(c) == "Cc" or ord(c) in MARKS)]


def fill(message: Any, depth: int = 0) -> Any:
    """Every text of a message evil, every list with two of them."""
    for field in message.DESCRIPTOR.fields:
        many = field.label == FieldDescriptor.LABEL_REPEATED
        if field.type == FieldDescriptor.TYPE_MESSAGE:
            if depth > 4 or field.message_type.GetOptions().map_entry:
                continue
            for _ in range(2 if many else 1):
                fill(getattr(message, field.name).add() if many else getattr(message, field.name), depth + 1)
            continue
        value: Any = 1
        if field.type == FieldDescriptor.TYPE_STRING:
            value = "a" * 32 if field.name == "token" else EVIL
        elif field.type == FieldDescriptor.TYPE_BYTES:
            value = b"\xff\x1b[2J"
        elif field.type in (FieldDescriptor.TYPE_DOUBLE, FieldDescriptor.TYPE_FLOAT):
            value = 1.5
        if many:
            getattr(message, field.name).extend([value, value])
        else:
            setattr(message, field.name, value)
    return message


class FalseDaemon(grpc.GenericRpcHandler):
    """Answers every call of the contract with evil texts, or refuses it with them."""

    def __init__(self) -> None:
        self.refuses = False
        self._methods: dict[str, tuple[str, bool, bool]] = {}  # by path: the answer's type, who streams
        for part in pkgutil.iter_modules(hapticd.v1.__path__):
            file = descriptor_pb2.FileDescriptorProto()
            importlib.import_module(f"hapticd.v1.{part.name}").DESCRIPTOR.CopyToProto(file)
            for service in file.service:
                for method in service.method:
                    path = f"/{file.package}.{service.name}/{method.name}"
                    self._methods[path] = (method.output_type[1:], method.client_streaming, method.server_streaming)
        self._server = grpc.server(futures.ThreadPoolExecutor(32))
        self._server.add_generic_rpc_handlers((self,))
        self.address = f"127.0.0.1:{self._server.add_insecure_port('127.0.0.1:0')}"
        self._server.start()

    def end(self) -> None:
        self._server.stop(None)

    def service(self, details: grpc.HandlerCallDetails) -> Any:
        if details.method not in self._methods:
            return None
        answer, takes_many, gives_many = self._methods[details.method]
        made = symbol_database.Default().GetSymbol(answer)

        def one(_: Any, context: grpc.ServicerContext) -> Any:
            if self.refuses:
                detail = any_pb2.Any()
                detail.Pack(fill(common_pb2.ErrorDetail()))
                # google.rpc.Status, by hand: its third field is a list of Any.
                body = detail.SerializeToString()
                size = bytes([len(body) & 0x7F | 0x80, len(body) >> 7])
                context.set_trailing_metadata((("grpc-status-details-bin", b"\x1a" + size + body),))
                context.abort(grpc.StatusCode.INVALID_ARGUMENT, EVIL)
            return fill(made())

        def several(request: Any, context: grpc.ServicerContext) -> Iterator[Any]:
            for _ in range(3):
                yield one(request, context)

        serialize = made.SerializeToString
        if takes_many:
            return grpc.stream_unary_rpc_method_handler(one, None, serialize)
        if gives_many:
            return grpc.unary_stream_rpc_method_handler(several, None, serialize)
        return grpc.unary_unary_rpc_method_handler(one, None, serialize)


@pytest.fixture(scope="module")
def false_daemon() -> Iterator[FalseDaemon]:
    daemon = FalseDaemon()
    yield daemon
    daemon.end()


COMMANDS = """
status --parts --rough
doctor
scene list
scene load tap_1d
scene unload
scene explain tap_1d
target set 0.3
target get
feasible
stop
clear
faults
telemetry watch --seconds 1
telemetry record out.csv --seconds 1
record start press
record stop
record annotate text
record list
record get last
record get some --out some.mcap
record delete some
incident list
incident show last --out incident.svg
incident make text
incident get last
log
log --follow
model list
model show sponge_cut
model diff ab cd
model tag ab current
model untag ab current
model delete ab
model export ab
sensor bias
device home
turntable status
turntable stations
turntable home
turntable goto sponge
turntable stop
turntable clear
guide to 0 0 0
presentation begin
presentation end
identify list
identify watch some
identify contact --object ball
calibrate registration
calibration list
calibration show ab
calibration adopt ab
access
console
console --print
lease get
lease watch
lease hold -- true
watchdog get
clock get
pose once
pose watch --seconds 1
sim object ball
sim hand rest
demo
""".strip().splitlines()
#: These print a document as it is, in its lines.
DOCUMENTS = ("scene explain", "model show", "model export")


def output_of(words: list[Any], limit_s: float, **how: Any) -> str:
    """All that a program writes, also one that does not end."""
    process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **how)
    try:
        output, _ = process.communicate(timeout=limit_s)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate()
    assert process.returncode >= 0 or process.returncode == -signal.SIGINT, f"ended by signal {-process.returncode}: {output!r}"
    return output.decode("utf-8")


def run(command: str, server: str, folder: Path, *more: str) -> str:
    environment = {**os.environ, "LANG": "C.UTF-8", "DISPLAY": ""}
    words = [BINARIES.resolve() / "hapticctl", *command.split(), *more, "--server", server, "--timeout", "3"]
    return output_of(words, 8, cwd=folder, env=environment)


@pytest.mark.parametrize("refuses", [False, True])
def test_a_false_daemon_moves_no_cursor(false_daemon: FalseDaemon, tmp_path: Path, refuses: bool) -> None:
    false_daemon.refuses = refuses

    def check(number: int, command: str, more: tuple[str, ...]) -> str:
        folder = tmp_path / f"in_{number}"
        folder.mkdir()
        output = run(command, false_daemon.address, folder, *more)
        if obeyed(output, "\n\t"):
            return f"{command}: {output!r}"
        if not command.startswith(DOCUMENTS) and any(line.startswith("forged line") for line in output.splitlines()):
            return f"{command} forges a line: {output!r}"
        return f"{command} ran a text as a command" if (folder / "forged").exists() else ""

    cases = [(command, more) for command in COMMANDS for more in ((), ("--json",))]
    with futures.ThreadPoolExecutor(8) as pool:  # most of them wait
        problems = pool.map(lambda one: check(one[0], *one[1]), enumerate(cases))
    assert [problem for problem in problems if problem] == []
    beside = [path.name for folder in (tmp_path, tmp_path.parent) for path in folder.iterdir() if path.is_file() and path.name != ".lock"]  # pytest's own
    assert beside == [], "a file was written outside its folder"


@pytest.mark.parametrize("command", ["status", "record list", "telemetry watch --seconds 1", "identify watch some", "log", "lease get"])
def test_on_a_terminal_only_its_own_styles_are_written(false_daemon: FalseDaemon, tmp_path: Path, command: str) -> None:
    false_daemon.refuses = False
    leader, follower = pty.openpty()
    process = subprocess.Popen(
        [BINARIES.resolve() / "hapticctl", *command.split(), "--server", false_daemon.address],
        env={**os.environ, "TERM": "xterm", "LANG": "C.UTF-8", "NO_COLOR": ""}, cwd=tmp_path,
        stdin=subprocess.DEVNULL, stdout=follower, stderr=follower,
    )  # fmt: skip
    os.close(follower)
    until = threading.Timer(8.0, process.send_signal, [signal.SIGINT])  # of those that watch
    until.start()
    written = b""
    try:
        while piece := os.read(leader, 65536):
            written += piece
    except OSError:  # its end has been closed
        pass
    process.wait()
    until.cancel()
    os.close(leader)
    text = OWN.sub("", written.decode("utf-8"))
    assert not obeyed(text, "\r\n"), text


def test_what_clients_write_forges_no_line_of_the_log(start_daemon: Callable[..., Any], tmp_path: Path) -> None:
    state = tmp_path / "state"
    state.mkdir()
    configuration = tmp_path / "rig.toml"
    audit = tmp_path / "audit.jsonl"
    configuration.write_text(
        f'[recording]\nfolder = "{state}"\nkeep_free_mb = 0.0\n[access]\naudit_file = "{audit}"\n', encoding="utf-8"
    )
    daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration))
    with hapticd.connect(daemon.address) as rig:
        rig.stop(reason=EVIL)
        rig.make_incident(reason=EVIL)
        rig.start_recording(name=EVIL, note=EVIL)
        rig.annotate_recording(text=EVIL)
        rig.stop_recording()
        for scene in (EVIL, "a\nforged line"):
            with pytest.raises(hapticd.errors.HapticdError) as refused:
                rig.load_scene(name=scene)
            assert not obeyed(str(refused.value), "")
        with rig.lease(EVIL):
            for command in ("status", "log -n 1000", "record list", "incident list", "lease get"):
                output = run(command, daemon.address, tmp_path)
                assert not obeyed(output), f"{command}: {output!r}"
                assert not any(line.startswith("forged line") for line in output.splitlines()), output
    daemon.end()
    for log in (daemon.log, audit):
        lines = log.read_text(encoding="utf-8")
        assert "forged line" in lines, lines
        assert not obeyed(lines), lines
        assert not any(line.startswith("forged line") for line in lines.splitlines()), lines


def test_a_token_that_is_none_is_refused_before_it_is_sent(start_daemon: Callable[..., Any], tmp_path: Path) -> None:
    daemon = start_daemon()
    for token in ("\u00fc", "a\nb", "x" * 32, "a" * 33, "\x1b[2J"):
        with hapticd.connect(daemon.address, lease_token=token) as rig, pytest.raises(hapticd.errors.BadArgument):
            rig.get_rig_state()
        done = subprocess.run(
            [BINARIES / "hapticctl", "status", "--server", daemon.address],
            env={**os.environ, "HAPTICD_LEASE": token}, capture_output=True, check=False,
        )  # fmt: skip
        assert done.returncode == 1, done
        assert b"the lease token is malformed" in done.stderr


def test_printable_escapes_what_is_obeyed_and_nothing_else() -> None:
    shown = printable(EVIL)
    assert not obeyed(shown, "")
    assert printable(shown) == shown
    assert shown.startswith("\\u001b]0;owned\\u0007")
    plain = "µN, 力, 🖐, «a»"
    assert printable(plain) == plain


def test_the_python_command_line_prints_no_cursor_movement(false_daemon: FalseDaemon) -> None:
    for refuses in (False, True):
        false_daemon.refuses = refuses
        environment = {**os.environ, "HAPTICD_SERVER": false_daemon.address}
        output = output_of([sys.executable, "-m", "hapticd.experiment", "check", "stiffness_1d"], 20, env=environment)
        assert ("`touch forged`" if refuses else "stiffness") in output.lower() and not obeyed(output), output


def own_recordings(folder: Path) -> Path:
    configuration = folder / "recordings.toml"
    configuration.write_text(f'[recording]\nfolder = "{folder / "recordings"}"\n')
    return configuration


#: What is typed, the exit code, and what is said.
TYPED = [
    ("traget set 3", 2, ["no such command", "did you mean 'target'?"]),
    ("--json sim hand pres", 2, ['"what": "there is no such command"', "did you mean 'press'?"]),
    ("target set abc", 2, ["hapticctl: usage:", "abc", "hapticctl target set --help"]),
    ("target set 0.3", 1, ["no scene is loaded", "hapticctl scene load NAME"]),
    ("pose watch --frame reference", 1, ["given     reference", "take the frame rig"]),
    ("scene show tap_1d", 0, ["name", "tap_1d"]),
    ("record delete last", 2, ["there is none yet"]),
    ("record start some/name", 0, ["some_name", "'some/name' cannot be a part"]),
    ("record stop", 0, []),
    ("record delete last", 0, ["deleted", "some_name"]),
    ("scene load /dev/null", 2, ["the scene file is empty", "hapticctl scene show"]),
    ("sim object none", 0, []),
    ("scene load tap_1d", 0, ["in use from tick", "hapticctl scene explain tap_1d"]),
    ("sim hand follow", 0, []),
    ("guide contact --within 3", 2, ["no contact within the way", "--within"]),
    ("sim object sponge_block", 0, []),
    ("sim hand press --force 1 --hold 0.1 --wait", 0, ["the hand is done: press"]),
    ("sim hand press --hold -1 --wait", 2, ["never ends such a program", "--hold", "leave out --wait"]),
    ("scene unload", 0, []),
    ("status", 0, ["no force: no scene is loaded"]),
]


def test_what_is_typed_is_answered_in_words_of_the_command_line(start_daemon: Callable[..., Any], tmp_path: Path) -> None:
    daemon = start_daemon("--model-store", ":memory:", "--config", str(own_recordings(tmp_path)))
    for line, code, told in TYPED:
        ended = subprocess.run(
            [BINARIES / "hapticctl", "--server", daemon.address, *line.split()], capture_output=True, text=True, check=False
        )
        said = ended.stdout + ended.stderr
        assert ended.returncode == code, f"{line}: {said}"
        for text in told:
            assert text in said, f"{line}: {said}"


def test_a_pedal_that_does_not_say_whether_it_is_pressed_is_told_the_options(start_daemon: Callable[..., Any], tmp_path: Path) -> None:
    configuration = tmp_path / "pedal.toml"
    configuration.write_text('[[watchdog.endpoint]]\nname = "pedal"\npedal = true\n')
    daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration))
    said = output_of([BINARIES / "hapticctl", "--server", daemon.address, "watchdog", "hold", "pedal"], 20)
    assert "a pedal does not say whether it is pressed" in said and "--pressed or --released" in said, said


def test_an_example_without_a_daemon_says_how_it_takes_the_address() -> None:
    said = output_of([BINARIES / "first_client", "127.0.0.1:1"], 60)
    assert "no daemon answers" in said and "first_client takes no options: the address is its argument" in said, said


def test_a_flag_of_a_replayed_rig_that_is_none_is_named() -> None:
    said = output_of([BINARIES / "hapticd", "--rig", "replay:run.csv?loop=yes", "--check-config"], 60)
    assert "unknown value of 'loop': 'yes'" in said and "true, false" in said, said


def test_the_emulated_rig_prints_a_command_that_can_be_pasted(tmp_path: Path) -> None:
    command = [BINARIES.resolve() / "hapticd_emulated_rig", "--write", "rig.toml", "--seconds", "0.1"]
    said = output_of(command, 60, cwd=tmp_path).splitlines()
    assert any(line.endswith(f" '{BINARIES.resolve() / 'hapticd'}' --config 'rig.toml'") for line in said), said


@pytest.mark.parametrize("command", ["--json status", "status", "scene list", "--help", "completion bash"])
def test_an_output_that_is_lost_is_no_success(start_daemon: Callable[..., Any], command: str) -> None:
    daemon = start_daemon()
    with open("/dev/full", "w") as full:
        ended = subprocess.run(
            [BINARIES / "hapticctl", "--server", daemon.address, *command.split()], stdout=full, stderr=subprocess.PIPE, check=False
        )
    assert ended.returncode == 2 and b"could not be written" in ended.stderr
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as closed:  # as where a shell has SIGPIPE ignored
        ended = subprocess.run(
            [BINARIES / "hapticctl", "--server", daemon.address, *command.split()],
            stdout=closed, stderr=subprocess.PIPE, check=False, restore_signals=False,
        )
    assert ended.returncode == 2 and b"could not be written" in ended.stderr


def test_events_and_the_log_have_names_as_they_were_written(start_daemon: Callable[..., Any], tmp_path: Path) -> None:
    daemon = start_daemon("--model-store", ":memory:", "--config", str(own_recordings(tmp_path)))
    for note in ("Prüfung", "힘 측정"):
        for line in (["record", "start", "x", "--note", note], ["record", "stop"]):
            subprocess.run([BINARIES / "hapticctl", "--server", daemon.address, *line], check=True, capture_output=True)
    log = subprocess.run([BINARIES / "hapticctl", "--server", daemon.address, "log"], check=True, capture_output=True, text=True)
    assert "Prüfung" in log.stdout and "힘 측정" in log.stdout and "\\3" not in log.stdout
