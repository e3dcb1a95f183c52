"""Table of calls that the generated code uses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Iterable, Mapping, Optional, Type

from google.protobuf.message import Message


@dataclass(frozen=True)
class Call:
    """One call of the contract."""

    name: str  #: "RenderingService/SetTarget"
    request: Type[Message]
    response: Type[Message]
    python_name: str  #: "set_target"
    more_s: float  #: how much longer than other calls it may take

    @property
    def path(self) -> str:
        return "/hapticd.v1." + self.name


class Caller:
    """How a program calls; Rig fills it in."""

    def _call(self, call: Call, arguments: Mapping[str, Any], deadline_s: Optional[float]) -> Message:
        raise NotImplementedError

    def _stream(self, call: Call, arguments: Mapping[str, Any], deadline_s: Optional[float]) -> Any:
        raise NotImplementedError

    def _send(self, call: Call, requests: Iterable[Message], deadline_s: Optional[float]) -> Message:
        raise NotImplementedError


class AsyncCaller:
    """How a program of asyncio calls; aio.Rig fills it in."""

    async def _call(self, call: Call, arguments: Mapping[str, Any], deadline_s: Optional[float]) -> Message:
        raise NotImplementedError

    def _stream(self, call: Call, arguments: Mapping[str, Any], deadline_s: Optional[float]) -> Any:
        raise NotImplementedError

    async def _send(self, call: Call, requests: Any, deadline_s: Optional[float]) -> Message:
        raise NotImplementedError
