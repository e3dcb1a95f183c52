"""A visual AR system: the newest pose of the tool and the depth of the press, for each picture of 60 a second."""

import asyncio
import sys

import hapticd.aio


async def main() -> None:
    async with await hapticd.aio.connect(sys.argv[1] if len(sys.argv) > 1 else None) as rig:
        await rig.load_scene("tap_1d")
        pictures = 0
        async for block in await rig.telemetry(["sample", "deformation"], hz=250, latency_s=1 / 60):
            x, y, z = block.vector("sample_tip_position_mm")[-1]
            print(f"\rtip {x:7.2f} {y:7.2f} {z:7.2f} mm, {block['deformation_displacement_mm'][-1]:5.2f} mm deep", end="")
            pictures += 1
            if len(sys.argv) > 2 and pictures >= int(sys.argv[2]):
                return


asyncio.run(main())
