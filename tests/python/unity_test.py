"""The script for Unity compiles: against the published signatures of what it needs, and the messages that the commands of
its page make."""

from __future__ import annotations

import pathlib
import re
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
UNITY = ROOT / "client" / "unity"


def blocks(language: str) -> list[str]:
    """The blocks of a language in the script's page."""
    fences = re.findall(r"^```(\w*)\n(.*?)^```$", (UNITY / "README.md").read_text(), re.MULTILINE | re.DOTALL)
    return [text for name, text in fences if name == language]


def messages_made(folder: pathlib.Path) -> str:
    """What the page's commands make of the contract, without what is Google.Protobuf's."""
    (folder / "proto").symlink_to(ROOT / "proto")
    for commands in blocks(""):
        subprocess.run(["bash", "-euc", commands], cwd=folder, check=True)
    text = "namespace Hapticd.V1 {\n"
    for file in sorted((folder / "Assets" / "Hapticd").glob("*.cs")):
        made = file.read_text()
        text += "".join(f"public enum {name} {{ }}\n" for name in re.findall(r"^  public enum (\w+) \{", made, re.MULTILINE))
        for name, body in re.findall(r"^  public sealed partial class (\w+) : pb::IMessage(.*?)^  \}$", made, re.MULTILINE | re.DOTALL):
            text += f"public class {name} : Google.Protobuf.IMessage<{name}> {{\n"
            text += f"  public static Google.Protobuf.MessageParser<{name}> Parser {{ get {{ return null; }} }}\n"
            for kind, field in re.findall(r"^    public ([a-z]+|global::Hapticd\.V1\.\w+) (\w+) \{$", body, re.MULTILINE):
                text += f"  public {kind} {field} {{ get; set; }}\n"
            text += "}\n"
    return text + "}\n"


def test_the_script_compiles(tmp_path: pathlib.Path) -> None:
    if shutil.which("mcs") is None:
        pytest.skip("mono-mcs is not installed: the script for Unity was not compiled")
    messages = tmp_path / "messages.cs"
    messages.write_text(messages_made(tmp_path))
    handler = tmp_path / "handler.cs"
    handler.write_text("\n".join(blocks("csharp")))
    compiled = subprocess.run(
        ["mcs", "-target:library", "-langversion:7.2", "-warn:0", f"-out:{tmp_path}/tool.dll",
         str(UNITY / "HapticdTool.cs"), str(pathlib.Path(__file__).with_name("unity_stubs.cs")), str(messages), str(handler)],
        capture_output=True, text=True, check=False)  # fmt: skip
    assert compiled.returncode == 0, compiled.stdout + compiled.stderr
