"""What is asked of TelemetryService.Subscribe."""

from __future__ import annotations

import math
import numbers
from typing import Any, Optional, Sequence, Union

from hapticd.errors import BadArgument

MAX_DECIMATION = 10000
MAX_BATCH = 1000
QUEUE_SAMPLES = (100, 60000)


def require_number(value: Any, where: str, unit: str) -> None:
    """Raises BadArgument if it is not a finite number, of numpy or not."""
    if not isinstance(value, numbers.Real) or not math.isfinite(value):
        raise BadArgument("this is not a number", where=where, value=repr(value), limit=f"a finite number of {unit}, e.g. 1.5")


def of(
    groups: Sequence[Union[int, str]], rate_hz: float, hz: Optional[float], latency_s: float, queue_s: float
) -> dict[str, Any]:
    """Arguments of subscribe(). rate_hz: of the loop; hz: at most so many samples a second; latency_s: age of the first
    sample of a block; queue_s: what the daemon keeps."""
    if hz is not None and hz != math.inf:
        require_number(hz, "telemetry(hz)", "Hz")
    require_number(latency_s, "telemetry(latency_s)", "seconds")
    require_number(queue_s, "telemetry(queue_s)", "seconds")
    if hz is not None and not rate_hz / MAX_DECIMATION <= hz:
        raise BadArgument(
            "the rate is too low",
            where="telemetry(hz)",
            value=f"{hz} Hz",
            limit=f"{rate_hz / MAX_DECIMATION} … {rate_hz} Hz",
        )
    decimation = 1 if hz is None else max(1, -int(-rate_hz // hz))
    samples_hz = rate_hz / decimation
    batch = min(max(int(samples_hz * latency_s), 1), MAX_BATCH)
    queue = min(max(int(samples_hz * queue_s), QUEUE_SAMPLES[0]), QUEUE_SAMPLES[1])
    return {
        "groups": groups,
        "decimation": decimation,
        "batch_size": batch,
        "queue_samples": queue,
        "encoding": "block",
    }
