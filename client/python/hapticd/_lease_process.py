"""The process that renews a lease, see _lease.py."""

from __future__ import annotations

import json
import select
import sys

import grpc

from hapticd._connection import TOKEN_KEY, Endpoint
from hapticd.v1 import access_pb2


def main() -> int:
    """Renews three times in the time to live, until its input ends or the lease is no longer in force."""
    order = json.loads(sys.stdin.readline())
    endpoint = Endpoint.of(order["address"], order["certificates"])
    renew = endpoint.open().unary_unary(
        "/hapticd.v1.LeaseService/RenewLease",
        request_serializer=access_pb2.RenewLeaseRequest.SerializeToString,
        response_deserializer=access_pb2.Lease.FromString,
    )
    pause_s = order["ttl_s"] / 3.0
    while True:  # at once: this process took its time to start
        try:
            renew(access_pb2.RenewLeaseRequest(), timeout=pause_s, metadata=((TOKEN_KEY, order["token"]),))
        except grpc.RpcError as error:
            if error.code() == grpc.StatusCode.ABORTED:  # the next command of the program hears why
                return 1
        if select.select([sys.stdin], [], [], pause_s)[0]:
            return 0


if __name__ == "__main__":
    sys.exit(main())
