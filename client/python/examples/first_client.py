"""Sets a target stiffness and prints what comes in over telemetry for two seconds."""

import sys

import grpc
from hapticd.v1 import rendering_pb2, rendering_pb2_grpc, scene_pb2, scene_pb2_grpc
from hapticd.v1 import telemetry_pb2, telemetry_pb2_grpc

channel = grpc.insecure_channel(sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:50051")
try:
    scenes = scene_pb2_grpc.SceneServiceStub(channel)
    scenes.LoadScene(scene_pb2.LoadSceneRequest(name="tap_1d"), timeout=15)

    rendering = rendering_pb2_grpc.RenderingServiceStub(channel)
    answer = rendering.SetTarget(rendering_pb2.SetTargetRequest(stiffness_n_per_mm=0.3), timeout=5)
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
except grpc.RpcError as error:
    sys.exit(f"{error.code().name}: {error.details()!r}")
