"""Scan of a real object by touches, into a virtual one of its shape: the section [wall.surface] of a scene."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.interpolate import RBFInterpolator

from hapticd.block import Block
from hapticd.errors import BadArgument

Array = npt.NDArray[np.float64]

MIN_TOUCHES = 9
MAX_SIDE = 64
#: A touch that is further than this from what the others say is an outlier, in robust standard deviations and at least in mm.
OUTLIER, OUTLIER_MM = 4.0, 1.0


def touches_of(block: Block) -> Array:
    """Positions of the tool when each contact began, N×3, mm, rig frame. The block needs the groups sample and contact."""
    contact = block["contact_in_contact"] > 0.5
    begins = np.flatnonzero(contact[1:] & ~contact[:-1]) + 1
    return np.asarray(np.stack([block[f"sample_tip_position_{axis}_mm"][begins] for axis in "xyz"], axis=1), dtype=float)


def _plate(touches: Array, smoothing: float) -> RBFInterpolator:
    return RBFInterpolator(touches[:, :2], touches[:, 2], smoothing=smoothing, kernel="thin_plate_spline")


def _without_outliers(touches: Array, smoothing: float) -> Array:
    """Drops the touch that the others contradict the most, while there is one; a quarter of all at most."""
    for _ in range(len(touches) // 4):
        if len(touches) <= MIN_TOUCHES:
            break
        others = [np.delete(touches, i, axis=0) for i in range(len(touches))]
        left = np.array([abs(z - float(_plate(other, smoothing)([[x, y]])[0])) for (x, y, z), other in zip(touches, others)])
        worst = int(np.argmax(left))
        if left[worst] <= max(OUTLIER * 1.4826 * float(np.median(left)), OUTLIER_MM):
            break
        touches = others[worst]
    return touches


def surface_toml(touches_mm: Array, step_mm: float = 5.0, smoothing: float = 1.0, *, where: str = "surface_toml") -> str:
    """A surface through the touches (thin plate), over the rectangle that they span. smoothing: of the plate, 0: through each of
    them. where: what errors name, e.g. the file. Raises BadArgument for too few touches, or if they do not span an area."""
    touches = np.asarray(touches_mm, dtype=float)
    if touches.ndim != 2 or touches.shape[1] != 3 or not np.isfinite(touches).all():
        raise BadArgument("touches are needed", where=where, value=str(touches.shape), limit="N×3 finite numbers, mm")
    if len(touches) < MIN_TOUCHES:
        raise BadArgument(
            "too few touches", where=where, value=str(len(touches)), limit=f"≥ {MIN_TOUCHES}",
            remedy="tap the object all over while it is recorded, and leave it each time: a touch is each contact that begins in free air",
        )  # fmt: skip
    spread = np.linalg.svd(touches[:, :2] - touches[:, :2].mean(axis=0), compute_uv=False)
    if spread[1] < 0.1 * spread[0]:
        raise BadArgument("the touches lie on a line", where=where, limit="touches all over the surface")
    touches = _without_outliers(touches, smoothing)
    plate = _plate(touches, smoothing)
    low, high = touches[:, :2].min(axis=0), touches[:, :2].max(axis=0)
    columns, rows = (max(2, int(np.ceil(span / step_mm)) + 1) for span in high - low)
    if max(columns, rows) > MAX_SIDE:
        raise BadArgument(
            "the grid is too fine", where=where, value=f"{columns} × {rows}", limit=f"{MAX_SIDE} × {MAX_SIDE}",
            remedy=f"a step of {max(high - low) / (MAX_SIDE - 1):.1f} mm or more",
        )  # fmt: skip
    x, y = low[0] + step_mm * np.arange(columns), low[1] + step_mm * np.arange(rows)
    grid_x, grid_y = np.meshgrid(x, y)
    heights = plate(np.stack([grid_x.ravel(), grid_y.ravel()], axis=1)).reshape(rows, columns)
    lines = ",\n".join("  " + ", ".join(f"{height:.3f}" for height in row) for row in heights)
    return (
        f"[wall.surface]\nfrom_mm = [{low[0]:.3f}, {low[1]:.3f}]\nstep_mm = {step_mm:g}\ncolumns = {columns}\nheights_mm = [\n{lines},\n]\n"
    )
