"""Client for programs of asyncio.

    async with await hapticd.aio.connect() as rig:
        await rig.load_scene("tap_1d")
        async with rig.lease("pilot"):
            await rig.set_target(0.3)
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import time
from pathlib import Path
from types import TracebackType
from typing import Any, AsyncIterator, Iterable, Mapping, Optional, Type, Union

import grpc
from google.protobuf.message import Message

from hapticd import _telemetry_request
from hapticd._calls import AsyncCalls
from hapticd._connection import Endpoint, lease_metadata, why_unreachable
from hapticd._hand import HAND_POLL_S, hand_goes_on
from hapticd._lease import Renewal
from hapticd._requests import build
from hapticd._stop import StopOutcome, stop_at
from hapticd._streams import _Source
from hapticd._table import Call
from hapticd.errors import HapticdError, Unreachable, from_rpc
from hapticd.telemetry import AsyncTelemetry
from hapticd.uploads import upload_pieces
from hapticd.v1 import access_pb2, identification_pb2, safety_pb2


class Rig(AsyncCalls):
    """A daemon's rig: one coroutine for each call of the contract. Made by connect()."""

    def __init__(self, endpoint: Endpoint, channel: grpc.aio.Channel, timeout_s: float, token: str) -> None:
        self._endpoint = endpoint
        self._channel = channel
        self._timeout_s = timeout_s
        self._token = token

    @property
    def address(self) -> str:
        return self._endpoint.address

    async def close(self) -> None:
        await self._channel.close()

    async def __aenter__(self) -> Rig:
        return self

    async def __aexit__(
        self, kind: Optional[Type[BaseException]], value: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        await self.close()

    async def stop_by_both(self, reason: str = "") -> StopOutcome:
        """Stops as Rig.stop_by_both() of the synchronous client."""
        run = asyncio.get_running_loop().run_in_executor
        return await run(None, stop_at, self._endpoint, reason, self._timeout_s)

    async def stop(self, reason: Optional[str] = None, *, deadline_s: Optional[float] = None) -> safety_pb2.StopResponse:
        """Stops as Rig.stop() of the synchronous client."""
        run = asyncio.get_running_loop().run_in_executor
        wait_s = deadline_s if deadline_s is not None else self._timeout_s
        return (await run(None, stop_at, self._endpoint, reason or "", wait_s)).answer

    @contextlib.asynccontextmanager
    async def lease(
        self,
        purpose: str = "",
        *,
        ttl_s: float = 5.0,
        on_expiry: Union[int, str, None] = None,
        take: Optional[str] = None,
    ) -> AsyncIterator[access_pb2.Lease]:
        """Lease as Rig.lease() of the synchronous client: renewed by a separate process, whatever the event loop does."""
        run = asyncio.get_running_loop().run_in_executor
        renewal = Renewal(self._endpoint, self._timeout_s)
        try:
            await run(None, renewal.wait_until_ready)
            if take is None:
                grant = await self.acquire_lease(purpose, ttl_s=ttl_s, on_expiry=on_expiry)
            else:
                grant = await self.take_lease(take, purpose=purpose, ttl_s=ttl_s, on_expiry=on_expiry)
            renewal.begin(grant.token, ttl_s)
            before, self._token = self._token, grant.token
            try:
                yield grant.lease
            finally:
                await run(None, renewal.stop)
                with contextlib.suppress(HapticdError):
                    await self.return_lease(deadline_s=1.0)
                self._token = before
        finally:
            await run(None, renewal.stop)

    async def telemetry(
        self,
        groups: Iterable[Union[int, str]] = (),
        *,
        hz: Optional[float] = None,
        latency_s: float = 0.1,
        queue_s: float = 4.0,
    ) -> AsyncTelemetry:
        """Telemetry as Rig.telemetry() of the synchronous client."""
        rate_hz = (await self.get_rig_info()).loop_rate_hz
        request = _telemetry_request.of(list(groups), rate_hz, hz, latency_s, queue_s)
        return AsyncTelemetry(self.subscribe(**request))

    async def wait_for_hand(self, timeout_s: float = 60.0) -> None:
        """Waits as Rig.wait_for_hand() of the synchronous client does."""
        until = time.monotonic() + timeout_s
        while not (await self.get_simulation()).hand_is_done:
            if time.monotonic() > until:
                raise hand_goes_on(timeout_s)
            await asyncio.sleep(HAND_POLL_S)

    async def upload_recording_file(
        self, path: Union[str, Path], **description: Any
    ) -> identification_pb2.UploadRecordingResponse:
        """A CSV or MCAP file for start_identification(). description: fields of RecordingDescription."""
        return await self.upload_recording(upload_pieces(Path(path), description))

    def _metadata(self) -> tuple[tuple[str, str], ...]:
        return lease_metadata(self._token)

    async def _call(self, call: Call, arguments: Mapping[str, Any], deadline_s: Optional[float]) -> Message:
        method = self._channel.unary_unary(
            call.path, request_serializer=call.request.SerializeToString, response_deserializer=call.response.FromString
        )
        wait_s = deadline_s if deadline_s is not None else self._timeout_s + call.more_s
        try:
            answer: Message = await method(build(call.request, arguments), timeout=wait_s, metadata=self._metadata())
            return answer
        except grpc.RpcError as error:
            raise from_rpc(error, self.address) from None

    def _stream(self, call: Call, arguments: Mapping[str, Any], deadline_s: Optional[float]) -> _Source:
        method = self._channel.unary_stream(
            call.path, request_serializer=call.request.SerializeToString, response_deserializer=call.response.FromString
        )
        return _Source(method(build(call.request, arguments), timeout=deadline_s, metadata=self._metadata()), self.address)

    async def _send(self, call: Call, requests: Any, deadline_s: Optional[float]) -> Message:
        method = self._channel.stream_unary(
            call.path, request_serializer=call.request.SerializeToString, response_deserializer=call.response.FromString
        )
        wait_s = deadline_s if deadline_s is not None else self._timeout_s + call.more_s
        try:
            answer: Message = await method(requests, timeout=wait_s, metadata=self._metadata())
            return answer
        except grpc.RpcError as error:
            raise from_rpc(error, self.address) from None


async def connect(
    address: Optional[str] = None, *, timeout_s: float = 5.0, certificates: Optional[str] = None, lease_token: Optional[str] = None
) -> Rig:
    """Connects as hapticd.connect()."""
    endpoint = Endpoint.of(address, certificates)
    channel = endpoint.open_aio()
    rig = Rig(endpoint, channel, timeout_s, lease_token if lease_token is not None else os.environ.get("HAPTICD_LEASE", ""))
    try:
        await asyncio.wait_for(_connected(channel), timeout_s)
    except (asyncio.TimeoutError, ConnectionError):
        await channel.close()
        what, remedy = await asyncio.get_running_loop().run_in_executor(None, why_unreachable, endpoint.address, timeout_s)
        raise Unreachable(what, where=endpoint.address, remedy=remedy) from None
    return rig


async def _connected(channel: grpc.aio.Channel) -> None:
    state = channel.get_state(try_to_connect=True)
    while state != grpc.ChannelConnectivity.READY:
        if state == grpc.ChannelConnectivity.TRANSIENT_FAILURE:
            raise ConnectionError
        await channel.wait_for_state_change(state)
        state = channel.get_state(try_to_connect=True)
