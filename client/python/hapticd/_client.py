"""A connection to a daemon, for programs."""

from __future__ import annotations

import contextlib
import os
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Iterable, Iterator, Mapping, Optional, Type, Union

import grpc
from google.protobuf.message import Message

from hapticd import _telemetry_request
from hapticd._calls import Calls
from hapticd._connection import Endpoint, lease_metadata, why_unreachable
from hapticd._hand import HAND_POLL_S, hand_goes_on
from hapticd._lease import Renewal
from hapticd._requests import build
from hapticd._stop import StopOutcome, stop_by_both
from hapticd._streams import _Source
from hapticd._table import Call
from hapticd.block import Block
from hapticd.errors import HapticdError, Refused, Unreachable, from_rpc
from hapticd.telemetry import Telemetry
from hapticd.uploads import upload_pieces
from hapticd.v1 import access_pb2, identification_pb2, safety_pb2

#: An interruption at the wrong instant (Ctrl-C) makes gRPC lose a call for whose end its channel then waits for ever.
_CLOSE_S = 2.0


class Rig(Calls):
    """A daemon's rig: one method for each call of the contract, and what is easier than calls.

    Any thread may call. Made by connect(); close() it, or use it as a context manager.
    """

    def __init__(self, endpoint: Endpoint, channel: grpc.Channel, timeout_s: float, token: str) -> None:
        self._endpoint = endpoint
        self._channel = channel
        self._timeout_s = timeout_s
        self._token = token

    @property
    def address(self) -> str:
        """Address as given."""
        return self._endpoint.address

    def close(self) -> None:
        """Ends its calls. Returns within two seconds."""
        closing = threading.Thread(target=self._channel.close, daemon=True)
        try:
            closing.start()
        except RuntimeError:  # this user may start no further thread
            self._channel.close()
        else:
            closing.join(_CLOSE_S)

    def __enter__(self) -> Rig:
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], value: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()

    @contextlib.contextmanager
    def lease(
        self,
        purpose: str = "",
        *,
        ttl_s: float = 5.0,
        on_expiry: Union[int, str, None] = None,
        take: Optional[str] = None,
    ) -> Iterator[access_pb2.Lease]:
        """Exclusive control of the rig while the block runs; all calls of this object go under it.

        ttl_s: 1 … 60 s. Renewed by a separate process, which is started first and takes about half a second: the lease
        holds while this program computes, and no longer than it lives. on_expiry: "keep", "ramp_to_zero" or "stop".
        take: why it is taken from the client that holds it.

        Raises NotAllowed (LEASE_HELD) if another client has it; LeaseLost at the next command when it was taken.
        """
        renewal = Renewal(self._endpoint, self._timeout_s)
        try:
            renewal.wait_until_ready()
            if take is None:
                grant = self.acquire_lease(purpose, ttl_s=ttl_s, on_expiry=on_expiry)
            else:
                grant = self.take_lease(take, purpose=purpose, ttl_s=ttl_s, on_expiry=on_expiry)
            renewal.begin(grant.token, ttl_s)
            before, self._token = self._token, grant.token
            try:
                yield grant.lease
            finally:
                renewal.stop()
                with contextlib.suppress(HapticdError):  # it is over, or the daemon is
                    self.return_lease(deadline_s=1.0)
                self._token = before
        finally:
            renewal.stop()

    def stop_by_both(self, reason: str = "") -> StopOutcome:
        """stop() by two paths at once, of which one does not pass gRPC: says which answered first. hapticd.stop() does the
        same without a connection. Raises HapticdError if neither answers in time: use the emergency stop."""
        return stop_by_both(self._endpoint, lambda: contextlib.nullcontext(self._channel), reason, self._timeout_s)

    def stop(self, reason: Optional[str] = None, *, deadline_s: Optional[float] = None) -> safety_pb2.StopResponse:
        """Zero force from the second tick at the latest, until clear(). By both paths, see stop_by_both()."""
        wait_s = deadline_s if deadline_s is not None else self._timeout_s
        return stop_by_both(self._endpoint, lambda: contextlib.nullcontext(self._channel), reason or "", wait_s).answer

    def telemetry(
        self,
        groups: Iterable[Union[int, str]] = (),
        *,
        hz: Optional[float] = None,
        latency_s: float = 0.1,
        queue_s: float = 4.0,
    ) -> Telemetry:
        """The loop's records, live, as tables of numbers. groups: e.g. ["motion", "control"]; none: all that exist.

        hz: at most so many samples a second; None: every tick. latency_s: how old the first sample of a block may be.
        queue_s: what the daemon keeps for this client while it does not read; beyond, samples are lost, and counted.
        """
        rate_hz = self.get_rig_info().loop_rate_hz
        request = _telemetry_request.of(list(groups), rate_hz, hz, latency_s, queue_s)
        return Telemetry(self.subscribe(**request), rate_hz / request["decimation"])

    def read(self, seconds: float, groups: Iterable[Union[int, str]] = (), *, hz: Optional[float] = None) -> Block:
        """The telemetry of the next `seconds`."""
        _telemetry_request.require_number(seconds, "read(seconds)", "seconds")
        with self.telemetry(groups, hz=hz) as stream:
            return stream.take(seconds)

    def wait_for_hand(self, timeout_s: float = 60.0) -> None:
        """Returns when the simulated hand has ended its program and the tool is free. Raises TimedOut if it has not by then:
        a program with negative hold_s or repetitions, a weight, a shaken device and a hand that follows never end."""
        until = time.monotonic() + timeout_s
        while not self.get_simulation().hand_is_done:
            if time.monotonic() > until:
                raise hand_goes_on(timeout_s)
            time.sleep(HAND_POLL_S)

    def read_hand(
        self, program: Mapping[str, Any], groups: Iterable[Union[int, str]] = (), *, hz: Optional[float] = None, timeout_s: float = 60.0
    ) -> Block:
        """Sets a program of the simulated hand, and returns the telemetry until it has ended, as wait_for_hand() says."""
        until = time.monotonic() + timeout_s
        blocks: list[Block] = []
        with self.telemetry(groups, hz=hz) as stream:
            self.set_hand_program(program)
            for block in stream:
                blocks.append(block)
                if self.get_simulation().hand_is_done:
                    return Block.joined(blocks)
                if time.monotonic() > until:
                    raise hand_goes_on(timeout_s)
        raise Unreachable("the telemetry ended", where="Rig.read_hand", remedy="see whether hapticd still runs there")

    def upload_recording_file(self, path: Union[str, Path], **description: Any) -> identification_pb2.UploadRecordingResponse:
        """A CSV or MCAP file for start_identification(). description: fields of RecordingDescription."""
        return self.upload_recording(upload_pieces(Path(path), description))

    def download_recording(
        self,
        path: Union[str, Path],
        recording: str,
        *,
        kind: Union[int, str] = "recording",
        columns: Iterable[str] = (),
        from_s: float = 0.0,
        to_s: float = 0.0,
        decimation: int = 1,
    ) -> Path:
        """A recording of the daemon as a file of this machine: FILE.mcap as it is, FILE.h5 or FILE.csv as a table.

        recording: its id, or "last". The file appears when it is complete. columns, span (s) and decimation are for tables.
        Raises Refused if there is no such recording.
        """
        path = Path(path)
        if recording == "last":
            kept = self.list_recordings(kind=kind).recordings
            if not kept:
                raise Refused("there is none yet", where="download_recording", value="'last'", remedy="see list_recordings()")
            recording = kept[-1].id
        formats = {".h5": "hdf5", ".hdf5": "hdf5", ".csv": "csv"}
        if path.suffix in formats:
            pieces = self.export_recording(
                recording, kind=kind, format=formats[path.suffix], columns=columns, from_s=from_s, to_s=to_s, decimation=decimation
            )
        else:
            pieces = self.get_recording(recording, kind=kind)
        partial = path.with_name(path.name + ".part")
        try:
            left = None
            with partial.open("wb") as file:
                for piece in pieces:
                    left = (piece.total_bytes if left is None else left) - len(piece.data)
                    if left < 0:
                        raise Refused("the daemon sends more than it announced", where=str(path))
                    file.write(piece.data)
            os.replace(partial, path)
        finally:
            partial.unlink(missing_ok=True)
        return path

    def _metadata(self) -> tuple[tuple[str, str], ...]:
        return lease_metadata(self._token)

    def _call(self, call: Call, arguments: Mapping[str, Any], deadline_s: Optional[float]) -> Message:
        method = self._channel.unary_unary(
            call.path, request_serializer=call.request.SerializeToString, response_deserializer=call.response.FromString
        )
        wait_s = deadline_s if deadline_s is not None else self._timeout_s + call.more_s
        try:
            answer: Message = method(build(call.request, arguments), timeout=wait_s, metadata=self._metadata())
            return answer
        except grpc.RpcError as error:
            raise from_rpc(error, self.address) from None

    def _stream(self, call: Call, arguments: Mapping[str, Any], deadline_s: Optional[float]) -> _Source:
        method = self._channel.unary_stream(
            call.path, request_serializer=call.request.SerializeToString, response_deserializer=call.response.FromString
        )
        return _Source(method(build(call.request, arguments), timeout=deadline_s, metadata=self._metadata()), self.address)

    def _send(self, call: Call, requests: Iterable[Message], deadline_s: Optional[float]) -> Message:
        method = self._channel.stream_unary(
            call.path, request_serializer=call.request.SerializeToString, response_deserializer=call.response.FromString
        )
        wait_s = deadline_s if deadline_s is not None else self._timeout_s + call.more_s
        try:
            answer: Message = method(iter(requests), timeout=wait_s, metadata=self._metadata())
            return answer
        except grpc.RpcError as error:
            raise from_rpc(error, self.address) from None


def connect(
    address: Optional[str] = None, *, timeout_s: float = 5.0, certificates: Optional[str] = None, lease_token: Optional[str] = None
) -> Rig:
    """A connection to a daemon.

    address: "host:port", "[v6]:port" or "unix:/path"; None: $HAPTICD_SERVER, else 127.0.0.1:50051. Beyond this machine the
    connection carries certificates; "tls:host:port" has it carry them within this machine too.
    timeout_s: for connecting, and for each call. certificates: folder of client.crt, client.key and authority.crt; None:
    $HAPTICD_CERTIFICATES, else ~/.config/hapticd/certificates. lease_token: of a lease that another program keeps; None:
    $HAPTICD_LEASE, which `hapticctl lease hold` sets.

    Raises BadArgument (no address, no certificates), Unreachable (no daemon answers).
    """
    endpoint = Endpoint.of(address, certificates)
    channel = endpoint.open()
    rig = Rig(endpoint, channel, timeout_s, lease_token if lease_token is not None else os.environ.get("HAPTICD_LEASE", ""))
    if not _is_connected(channel, timeout_s):
        channel.close()
        what, remedy = why_unreachable(endpoint.address, timeout_s)
        raise Unreachable(what, where=endpoint.address, remedy=remedy)
    return rig


def _is_connected(channel: grpc.Channel, timeout_s: float) -> bool:
    """Waits until it is, but not for a second attempt once the first was refused."""
    decided = threading.Event()
    states: list[grpc.ChannelConnectivity] = []

    def on_change(state: grpc.ChannelConnectivity) -> None:
        if state in (grpc.ChannelConnectivity.READY, grpc.ChannelConnectivity.TRANSIENT_FAILURE):
            states.append(state)
            decided.set()

    channel.subscribe(on_change, try_to_connect=True)
    decided.wait(timeout_s)
    channel.unsubscribe(on_change)
    return states[:1] == [grpc.ChannelConnectivity.READY]


__all__ = ["Rig", "connect"]
