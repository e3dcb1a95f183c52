"""The process that renews a lease, see _lease.py."""

from __future__ import annotations

import contextlib
import json
import os
import select
import sys
import time

import grpc

from hapticd._connection import Endpoint, lease_metadata
from hapticd.v1 import access_pb2


def main() -> int:
    """Connects and says that it is ready; then renews three times in the time to live, until its input ends or the lease
    is no longer in force."""
    first = sys.stdin.readline()
    if not first:
        return 0
    place = json.loads(first)
    channel = Endpoint.of(place["address"], place["certificates"]).open()
    with contextlib.suppress(grpc.FutureTimeoutError):  # without a daemon there will be no lease to renew
        grpc.channel_ready_future(channel).result(timeout=place["connect_s"])
    with contextlib.suppress(BrokenPipeError):  # the program has ended
        os.write(sys.stdout.fileno(), b"ready\n")
    second = sys.stdin.readline()
    if not second:
        return 0
    order = json.loads(second)
    renew = channel.unary_unary(
        "/hapticd.v1.LeaseService/RenewLease",
        request_serializer=access_pb2.RenewLeaseRequest.SerializeToString,
        response_deserializer=access_pb2.Lease.FromString,
    )
    pause_s = order["ttl_s"] / 3.0
    due_s = time.monotonic()  # at once: the caller may have taken its time to hand over the token
    while True:
        try:
            renew(access_pb2.RenewLeaseRequest(), timeout=pause_s, metadata=lease_metadata(order["token"]))
        except grpc.RpcError as error:
            if error.code() == grpc.StatusCode.ABORTED:  # the next command of the program hears why
                return 1
        now_s = time.monotonic()
        due_s = max(due_s + pause_s, now_s)  # from attempt to attempt, however long one takes
        if select.select([sys.stdin], [], [], due_s - now_s)[0]:
            return 0


if __name__ == "__main__":
    sys.exit(main())
