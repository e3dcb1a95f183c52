#!/usr/bin/env python3
"""Makes the importable package: a copy of hapticd/, the messages of the contract, and the typed calls.

    /usr/bin/python3 client/python/generate.py --out build/python [--proto proto]

The calls are made from the contract and its comments: a call that is added there is there in Python, for programs and for
asyncio, without a line of code. Needs protoc (Debian: protobuf-compiler, python3-protobuf).
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Iterator

from google.protobuf import descriptor_pb2

HERE = Path(__file__).resolve().parent

# Where the contract's name says too little without its service.
NAMES = {
    "ClockService/Exchange": "exchange_clocks",
    "ClockService/GetClock": "get_clock",
    "PoseService/Subscribe": "poses",
    "RecordingService/Annotate": "annotate_recording",
    "TelemetryService/Subscribe": "subscribe",
    "TurntableService/Home": "home_turntable",
    "TurntableService/MoveTo": "move_turntable",
    "TurntableService/ClearAlarm": "clear_turntable_alarm",
    "TurntableService/Engage": "engage_turntable",
    "TurntableService/Disengage": "disengage_turntable",
}

# How much longer than other calls these may take, in s.
WAITS_S = {
    "LeaseService/TakeLease": 10.0,
    "RigService/Diagnose": 10.0,
    "RigService/BiasForceSensor": 10.0,
    "SceneService/LoadScene": 10.0,
    "SceneService/ExplainScene": 10.0,
    "RenderingService/SetTarget": 60.0,
    "RecordingService/StopRecording": 10.0,
    "IdentificationService/CancelIdentification": 30.0,
    "CalibrationService/PushReferencePoses": 600.0,
    "CalibrationService/FinishCalibration": 120.0,
    "CalibrationService/CancelCalibration": 120.0,
    "IdentificationService/UploadRecording": 600.0,
    "TurntableService/ClearAlarm": 30.0,
    "TurntableService/Engage": 30.0,
}

Field = descriptor_pb2.FieldDescriptorProto
SCALARS = {
    Field.TYPE_DOUBLE: "float",
    Field.TYPE_FLOAT: "float",
    Field.TYPE_BOOL: "bool",
    Field.TYPE_STRING: "str",
    Field.TYPE_BYTES: "bytes",
    Field.TYPE_ENUM: "Union[int, str]",
}


def run_protoc(proto: Path, out: Path, descriptors: Path) -> None:
    files = sorted(str(file.relative_to(proto)) for file in (proto / "hapticd/v1").glob("*.proto"))
    command = ["protoc", "-I", str(proto), f"--python_out={out}", f"--pyi_out={out}", "--include_source_info"]
    subprocess.run([*command, f"--descriptor_set_out={descriptors}", *files], check=True)


class Contract:
    """Messages by name, comments by place."""

    def __init__(self, descriptors: Path) -> None:
        self.files = descriptor_pb2.FileDescriptorSet.FromString(descriptors.read_bytes()).file
        self.messages = {
            f".{file.package}.{message.name}": (file, message, index)
            for file in self.files
            for index, message in enumerate(file.message_type)
        }
        self._comments = {
            (file.name, tuple(location.path)): " ".join(
                (location.leading_comments or location.trailing_comments).split()
            )
            for file in self.files
            for location in file.source_code_info.location
        }

    def comment(self, file: str, *path: int) -> str:
        return self._comments.get((file, path), "")

    def methods(self) -> Iterator[tuple[str, descriptor_pb2.MethodDescriptorProto, str]]:
        """Service, method and comment of each call."""
        for file in self.files:
            for s, service in enumerate(file.service):
                for m, method in enumerate(service.method):
                    yield service.name, method, self.comment(file.name, 6, s, 2, m)

    def type_of(self, full_name: str) -> str:
        file, message, _ = self.messages[full_name]
        return f"{Path(file.name).stem}_pb2.{message.name}"

    def argument_type(self, field: descriptor_pb2.FieldDescriptorProto) -> str:
        if field.type == Field.TYPE_MESSAGE:
            name = field.type_name.rsplit(".", 1)[-1]
            special = {"Vector3": "Vector", "Quaternion": "Orientation"}
            one = special.get(name) or f"Union[{self.type_of(field.type_name)}, Mapping[str, Any]]"
        else:
            one = SCALARS.get(field.type, "int")
        return f"Iterable[{one}]" if field.label == Field.LABEL_REPEATED else one


def python_name(service: str, method: str) -> str:
    return NAMES.get(f"{service}/{method}") or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", method).lower()


def wrapped(text: str, indent: str, first: str = "") -> str:
    words, lines, line = text.replace("\\", "\\\\").split(), [], indent + first
    for word in words:
        if len(line) + 1 + len(word) > 118 and line.strip():
            lines.append(line.rstrip())
            line = indent + ("    " if first else "")
        line += word + " "
    return "\n".join([*lines, line.rstrip()])


def docstring(contract: Contract, method: descriptor_pb2.MethodDescriptorProto, comment: str) -> str:
    file, request, index = contract.messages[method.input_type]
    lines = [wrapped(comment or "See docs/contract.md.", "        ", "").replace("        ", '        """', 1)]
    if not method.client_streaming:
        described = [
            wrapped(contract.comment(file.name, 4, index, 2, f), "        ", f"{field.name}: ")
            for f, field in enumerate(request.field)
            if contract.comment(file.name, 4, index, 2, f)
        ]
        if described:
            lines += ["", *described]
    if len(lines) == 1 and "\n" not in lines[0] and len(lines[0]) < 115:
        return lines[0] + '"""'
    return "\n".join(lines) + '\n        """'


def one_call(contract: Contract, service: str, method: descriptor_pb2.MethodDescriptorProto, comment: str, is_async: bool) -> str:
    name = python_name(service, method.name)
    response = contract.type_of(method.output_type)
    stream = "AsyncStream" if is_async else "Stream"
    table = f"TABLE[{service + '/' + method.name!r}]"
    awaited, keyword = ("await ", "async def") if is_async else ("", "def")
    document = docstring(contract, method, comment)
    if method.client_streaming:
        kind = contract.type_of(method.input_type)
        pieces = f"Union[Iterable[{kind}], AsyncIterable[{kind}]]" if is_async else f"Iterable[{kind}]"
        return (
            f"    {keyword} {name}(self, requests: {pieces}, *, deadline_s: Optional[float] = None) -> {response}:\n{document}\n"
            f"        return cast({response}, {awaited}self._send({table}, requests, deadline_s))\n"
        )
    fields = contract.messages[method.input_type][1].field
    arguments = [f"{field.name}: Optional[{contract.argument_type(field)}] = None" for field in fields]
    signature = ", ".join(["self", *arguments[:1], "*", *arguments[1:], "deadline_s: Optional[float] = None"])
    values = ", ".join(f'"{field.name}": {field.name}' for field in fields)
    if method.server_streaming:
        return (
            f"    def {name}({signature}) -> {stream}[{response}]:\n{document}\n"
            f"        return {stream}(self._stream({table}, {{{values}}}, deadline_s))\n"
        )
    return (
        f"    {keyword} {name}({signature}) -> {response}:\n{document}\n"
        f"        return cast({response}, {awaited}self._call({table}, {{{values}}}, deadline_s))\n"
    )


def write_calls(contract: Contract, target: Path) -> None:
    modules = sorted({Path(file.name).stem + "_pb2" for file in contract.files if file.name.startswith("hapticd/")})
    methods = list(contract.methods())
    lines = [
        '"""Every call of the contract. Made by generate.py: not to be edited."""',
        "",
        "from __future__ import annotations",
        "",
        "from typing import Any, AsyncIterable, Iterable, Mapping, Optional, Union, cast",
        "",
        "from hapticd._requests import Orientation, Vector",
        "from hapticd._table import Call, Caller, AsyncCaller",
        "from hapticd._streams import AsyncStream, Stream",
        "from hapticd.v1 import " + ", ".join(modules),
        "",
        "TABLE = {",
    ]
    for service, method, _ in methods:
        key = f"{service}/{method.name}"
        lines.append(
            f"    {key!r}: Call({key!r}, {contract.type_of(method.input_type)}, {contract.type_of(method.output_type)}, "
            f"{python_name(service, method.name)!r}, {WAITS_S.get(key, 0.0)}),"
        )
    lines += ["}", ""]
    for name, base, is_async in (("Calls", "Caller", False), ("AsyncCalls", "AsyncCaller", True)):
        lines += ["", f"class {name}({base}):", '    """One method for each call."""', ""]
        lines += [one_call(contract, service, method, comment, is_async) for service, method, comment in methods]
    target.write_text("\n".join(lines), encoding="utf-8")


def version() -> str:
    """Version of the project."""
    found = re.search(r"^project\(hapticd VERSION ([0-9.]+)", (HERE.parents[1] / "CMakeLists.txt").read_text(), re.MULTILINE)
    return found.group(1) if found else "0"


def make(out: Path, proto: Path) -> None:
    """The package hapticd in `out`, and what pip needs to make a wheel of it; what was there before is replaced."""
    package = out / "hapticd"
    out.mkdir(parents=True, exist_ok=True)
    if package.exists():
        shutil.rmtree(package)
    shutil.copytree(HERE / "hapticd", package, ignore=shutil.ignore_patterns("__pycache__"))
    with tempfile.TemporaryDirectory() as folder:
        descriptors = Path(folder) / "contract.binpb"
        run_protoc(proto, out, descriptors)
        (package / "v1" / "__init__.py").write_text('"""The messages of the contract."""\n', encoding="utf-8")
        write_calls(Contract(descriptors), package / "_calls.py")
    project = (HERE / "pyproject.toml").read_text(encoding="utf-8").replace("@VERSION@", version())
    (out / "pyproject.toml").write_text(project[project.index("[build-system]") :], encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(description="Makes the importable Python package hapticd.")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="the package goes to DIR/hapticd")
    parser.add_argument("--proto", type=Path, default=HERE.parents[1] / "proto", metavar="DIR", help="folder of the contract")
    arguments = parser.parse_args()
    make(arguments.out, arguments.proto)
    return 0


if __name__ == "__main__":
    sys.exit(main())
