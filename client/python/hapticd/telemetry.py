"""The loop's records, live."""

from __future__ import annotations

from types import TracebackType
from typing import Iterator, Optional, Type

import numpy as np

from hapticd._streams import AsyncStream, Stream
from hapticd._telemetry_request import require_number
from hapticd.block import Block, Columns
from hapticd.errors import Unreachable
from hapticd.v1 import telemetry_pb2


class _Decoder:
    """Blocks of a stream's batches."""

    def __init__(self) -> None:
        self._columns: Optional[Columns] = None
        self._lost = 0

    def block(self, batch: telemetry_pb2.TelemetryBatch) -> Optional[Block]:
        if self._columns is None or batch.block.columns:
            self._columns = Columns.of(batch.block.columns)
        total = batch.dropped_by_subscriber + batch.dropped_by_server
        lost, self._lost = total - self._lost, total
        rows = np.frombuffer(batch.block.rows, dtype=self._columns.dtype) if self._columns.names else np.empty(0)
        return Block(self._columns, rows, lost) if len(rows) or lost else None


class Telemetry:
    """Iterate over it for a Block at a time, or take() some seconds. Leaving its `with` block ends it."""

    def __init__(self, stream: Stream[telemetry_pb2.TelemetryBatch], sample_rate_hz: float) -> None:
        self._stream = stream
        self._decoder = _Decoder()
        #: Samples a second.
        self.sample_rate_hz = sample_rate_hz

    def __iter__(self) -> Iterator[Block]:
        for batch in self._stream:
            block = self._decoder.block(batch)
            if block is not None:
                yield block

    def take(self, seconds: float) -> Block:
        """Takes so many seconds of samples from now on, by the rig's clock. Raises Unreachable if the stream ends
        before."""
        require_number(seconds, "Telemetry.take(seconds)", "seconds")
        return self.take_samples(max(1, round(seconds * self.sample_rate_hz)))

    def take_samples(self, count: int) -> Block:
        blocks: list[Block] = []
        have = 0
        for block in self:
            blocks.append(block)
            have += len(block) + block.lost
            if have >= count:
                joined = Block.joined(blocks)
                return Block(joined.columns, joined.rows[: max(0, count - joined.lost)], joined.lost)
        raise Unreachable("the telemetry ended", where="Telemetry.take", remedy="see whether hapticd still runs there")

    def close(self) -> None:
        self._stream.cancel()

    def __enter__(self) -> Telemetry:
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], value: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()


class AsyncTelemetry:
    """Telemetry for asyncio: `async for block in rig.telemetry(…)`."""

    def __init__(self, stream: AsyncStream[telemetry_pb2.TelemetryBatch]) -> None:
        self._stream = stream
        self._decoder = _Decoder()

    def __aiter__(self) -> AsyncTelemetry:
        return self

    async def __anext__(self) -> Block:
        while True:
            block = self._decoder.block(await self._stream.__anext__())
            if block is not None:
                return block

    async def __aenter__(self) -> AsyncTelemetry:
        return self

    async def __aexit__(
        self, kind: Optional[Type[BaseException]], value: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self._stream.cancel()
