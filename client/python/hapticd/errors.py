"""What a call raises when it does not succeed.

A program branches on the class and on `reason`; the text is for people.
"""

from __future__ import annotations

from typing import Optional

import grpc
from google.protobuf import any_pb2, descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

from hapticd._shown import printable
from hapticd.v1 import common_pb2


class HapticdError(Exception):
    """Base of all errors of this package. str() is one line, safe for a terminal: place, complaint, value, what is
    accepted, remedy. The attributes have the texts as they came."""

    def __init__(
        self,
        what: str,
        *,
        where: str = "",
        value: str = "",
        limit: str = "",
        remedy: str = "",
        reason: str = "",
        code: str = "",
    ) -> None:
        self.what = what
        self.where = where
        self.value = value
        self.limit = limit
        self.remedy = remedy
        #: For programs: "LEASE_HELD", "OUT_OF_RANGE" …: ErrorReason of the contract without its prefix. Empty if the
        #: daemon gave none.
        self.reason = reason
        #: Name of the gRPC status, e.g. "INVALID_ARGUMENT"; empty if no call was made.
        self.code = code
        line = f"{where}: {what}" if where else what
        if value:
            line += f" (got {value})"
        if limit:
            line += f"; accepted: {limit}"
        if remedy:
            line += f"; {remedy}"
        super().__init__(printable(line))


class BadArgument(HapticdError, ValueError):
    """An argument cannot be sent: unknown name, wrong type. No call was made."""


class BadFile(HapticdError, ValueError):
    """A file is not what it should be."""


class MissingPackage(HapticdError, ImportError):
    """A Python package is not installed that only this function needs."""


class Unreachable(HapticdError, ConnectionError):
    """No daemon answers there, or the connection broke."""


class TimedOut(HapticdError, TimeoutError):
    """The daemon is there, but did not answer within the timeout."""


class Refused(HapticdError):
    """The daemon says no: see `reason`."""


class NotAllowed(Refused):
    """Refusal of what this client may not do: by its identity or role, or because another client controls the rig."""


class LeaseLost(NotAllowed):
    """Control of the rig was taken, has expired or was returned. Nothing of the command took effect."""


class Stopped(Refused):
    """The guard is latched: there is no force until someone clears it."""


class Cancelled(HapticdError):
    """End of a call that this client ended itself."""


_CLASS_OF_REASON = {
    "NOT_IDENTIFIED": NotAllowed,
    "NOT_PERMITTED": NotAllowed,
    "LEASE_HELD": NotAllowed,
    "LEASE_REQUIRED": NotAllowed,
    "LEASE_LOST": LeaseLost,
    "GUARD_LATCHED": Stopped,
    "FAULT_PERSISTS": Stopped,
}


def _make_envelope() -> type:
    """google.rpc.Status, of which only the third field is needed, under a name of our own."""
    file = descriptor_pb2.FileDescriptorProto(
        name="hapticd/envelope.proto", package="hapticd.envelope", dependency=["google/protobuf/any.proto"], syntax="proto3"
    )
    field = file.message_type.add(name="Status").field.add(name="details", number=3)
    field.label = descriptor_pb2.FieldDescriptorProto.LABEL_REPEATED
    field.type = descriptor_pb2.FieldDescriptorProto.TYPE_MESSAGE
    field.type_name = "." + any_pb2.Any.DESCRIPTOR.full_name
    pool = descriptor_pool.Default()
    pool.Add(file)
    descriptor = pool.FindMessageTypeByName("hapticd.envelope.Status")
    made: type = message_factory.MessageFactory(pool).GetPrototype(descriptor)
    return made


_ENVELOPE = _make_envelope()


def _detail_of(error: grpc.RpcError) -> Optional[common_pb2.ErrorDetail]:
    for key, value in error.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            try:
                status = _ENVELOPE.FromString(value)  # type: ignore[attr-defined]
                for packed in status.details:
                    detail = common_pb2.ErrorDetail()
                    if packed.Unpack(detail):
                        return detail
            except DecodeError:  # of a server that is none: the status says what it can
                return None
    return None


def from_rpc(error: grpc.RpcError, address: str) -> HapticdError:
    """The error of one call, of the parts a gRPC status carries; `address`: where the daemon was looked for."""
    status = error.code()
    code = status.name if status is not None else "UNKNOWN"
    detail = _detail_of(error)
    if detail is not None:
        return from_detail(detail, code)
    text = error.details() or "no reason given"
    if code == "CANCELLED":
        return Cancelled("the call was cancelled", code=code)
    if code == "UNAVAILABLE":
        return Unreachable(
            f"the connection to the daemon broke: {text}",
            where=address,
            code=code,
            remedy="see whether hapticd still runs there, and whether the network carries",
        )
    if code == "DEADLINE_EXCEEDED":
        return TimedOut(
            "the daemon did not answer in time", where=address, code=code, remedy="allow a longer deadline_s, or look at the daemon's log"
        )
    if code == "UNIMPLEMENTED":
        return Refused(
            "the daemon does not know this call", where=address, code=code, remedy="it is older than this client: update it"
        )
    return Refused(text, code=code)


def from_detail(detail: common_pb2.ErrorDetail, code: str = "") -> Refused:
    """The error that a daemon described."""
    try:
        reason = common_pb2.ErrorReason.Name(detail.reason).replace("ERROR_REASON_", "")
    except ValueError:  # of a daemon newer than this client: the status code says enough
        reason = ""
    kind = _CLASS_OF_REASON.get(reason, Refused)
    return kind(
        detail.what or "no reason given",
        where=detail.where,
        value=detail.value,
        limit=detail.limit,
        remedy=detail.remedy,
        reason="" if reason == "UNSPECIFIED" else reason,
        code=code,
    )
