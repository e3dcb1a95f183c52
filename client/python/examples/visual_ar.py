"""A visual AR system: where the tool is in the picture that is seen in 20 ms, for each picture of 60 a second."""

import asyncio
import sys
from typing import Optional

import hapticd.aio
from hapticd.v1 import pose_pb2


async def main() -> None:
    async with await hapticd.aio.connect(sys.argv[1] if len(sys.argv) > 1 else None) as rig:
        async with rig.lease("visual AR"):
            await rig.load_scene("tap_1d")
        newest: Optional[pose_pb2.Pose] = None

        async def read() -> None:
            nonlocal newest
            async for newest in rig.poses(120, predict_ms=20):
                pass  # without rest, so that the newest is never an old one

        reading = asyncio.create_task(read())
        pictures = int(sys.argv[2]) if len(sys.argv) > 2 else -1
        while pictures != 0 and not reading.done():
            await asyncio.sleep(1 / 60)  # draw
            if newest is None:
                continue
            p, error = newest.position_mm, newest.prediction.error_mm
            touched = f"touched {newest.contact.number} times" if newest.HasField("contact") else "not touched"
            print(f"\rtip {p.x:7.2f} {p.y:7.2f} {p.z:7.2f} mm ± {error:.2f}, {touched}", end="")
            pictures -= 1
        if reading.done():
            reading.result()  # says why it has ended
        reading.cancel()


asyncio.run(main())
