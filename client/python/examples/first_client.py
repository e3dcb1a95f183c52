"""Sets a target stiffness and prints what comes in over telemetry for two seconds."""

import os
import sys
from pathlib import Path

import grpc
from hapticd.v1 import access_pb2, access_pb2_grpc, rendering_pb2, rendering_pb2_grpc, scene_pb2, scene_pb2_grpc
from hapticd.v1 import telemetry_pb2, telemetry_pb2_grpc

address = sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:50051"
if address.startswith("unix:") or address.split(":")[0] in ("127.0.0.1", "localhost"):
    channel = grpc.insecure_channel(address)
else:  # from elsewhere, or tls:127.0.0.1:50051 through a tunnel: certificates show who calls
    folder = Path(os.environ["HAPTICD_CERTIFICATES"])
    files = [(folder / name).read_bytes() for name in ("authority.crt", "client.key", "client.crt")]
    channel = grpc.secure_channel(address.removeprefix("tls:"), grpc.ssl_channel_credentials(*files))
leases = access_pb2_grpc.LeaseServiceStub(channel)
try:
    # Long enough for all of it: it is not renewed here.
    lease = leases.AcquireLease(access_pb2.AcquireLeaseRequest(purpose="first client", ttl_s=30), timeout=5)
    token = [("hapticd-lease", lease.token)]

    scenes = scene_pb2_grpc.SceneServiceStub(channel)
    scenes.LoadScene(scene_pb2.LoadSceneRequest(name="tap_1d"), timeout=15, metadata=token)

    rendering = rendering_pb2_grpc.RenderingServiceStub(channel)
    wish = rendering_pb2.SetTargetRequest(stiffness_n_per_mm=0.3)
    answer = rendering.SetTarget(wish, timeout=5, metadata=token)
    print(f"granted {answer.granted_n_per_mm:.2f} N/mm {answer.explanation!r}")

    telemetry = telemetry_pb2_grpc.TelemetryServiceStub(channel)
    wanted = telemetry_pb2.SubscribeRequest(
        groups=[telemetry_pb2.FIELD_GROUP_CONTACT, telemetry_pb2.FIELD_GROUP_DEFORMATION], decimation=100
    )
    samples = 0
    for batch in telemetry.Subscribe(wanted):
        for sample in batch.samples:
            print(f"tick {sample.tick}: {sample.contact.reaction_force_n:.3f} N at "
                  f"{sample.deformation.displacement_mm:.3f} mm")
            samples += 1
        if samples >= 20:  # 2 s of every hundredth tick
            break
    leases.ReturnLease(access_pb2.ReturnLeaseRequest(), timeout=5, metadata=token)
except grpc.RpcError as error:
    sys.exit(f"{error.code().name}: {error.details()!r}")
