"""A tumour is found by the scan of the simulated hand, wherever it lies, without another phantom or model (D§5.3)."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import pytest

import hapticd
from hapticd.experiment import inclusions, protocol


def test_a_scan_finds_the_soft_tumour_where_it_was_put(start_daemon: Any, tmp_path: Path) -> None:
    configuration = tmp_path / "rig.toml"
    configuration.write_text('[rig.sim]\nspeed = 10\ntip = "ball_bearing"\n')
    daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration), rig="sim:phantom_1_5_high_force")
    with hapticd.connect(daemon.address) as rig, rig.lease("test"):
        rig.set_object("phantom_soft", inclusion_x_mm=6.0, inclusion_y_mm=-4.0)
        rig.start_identification(inclusion={"tip_radius_mm": 8.0}, object="lump", adopt=True)
        end = rig.watch_identification().last()
        assert end.model, end
        found = {one.name: one.value for one in end.parameters}
        # The sphere is that of the centre in the object: 25 mm deep of 55, under the point of contact (of 63 mm) that was given.
        assert found["place_x_mm"] == pytest.approx(6.0 * 30.0 / 63.0, abs=1.0)
        assert found["place_y_mm"] == pytest.approx(-4.0 * 30.0 / 63.0, abs=1.0)
        assert found["depth_mm"] == pytest.approx(25.0, abs=4.0)

        # Rendered elsewhere, it has turned about the middle of the phantom, as deep as before.
        scene = protocol.read("tumour_realism").condition("RsVs").comparison.scene_toml.replace("tumour_soft", "lump")

        def place(x_mm: float, y_mm: float) -> list[float]:
            outline = rig.explain_scene(toml=inclusions.moved(scene, x_mm, y_mm, (0.0, 0.0, -63.0)))
            remark = next(one for one in outline.remarks if "'lump' at" in one)
            return [float(one) for one in re.findall(r"at \[(.*?)\]", remark)[0].split(",")]

        before, after = place(0.0, 0.0), place(5.0, -7.0)
        centre = (0.0, 0.0, -63.0)
        assert math.dist(before, centre) == pytest.approx(math.dist(after, centre), abs=1e-6)
        share = math.dist(before, centre) / 63.0
        assert after[0] - before[0] == pytest.approx(5.0 * share, abs=0.3) and after[1] - before[1] == pytest.approx(-7.0 * share, abs=0.3)
        with pytest.raises(hapticd.HapticdError, match="beyond its object"):
            place(80.0, 0.0)
