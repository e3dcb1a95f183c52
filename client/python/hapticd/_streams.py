"""What the daemon answers with many messages."""

from __future__ import annotations

from types import TracebackType
from typing import Any, AsyncIterator, Generic, Iterator, Optional, Type, TypeVar

import grpc

from hapticd.errors import Cancelled, HapticdError, from_rpc

T = TypeVar("T")


class _Source:
    """A call that is under way, and the address for its errors."""

    def __init__(self, call: Any, address: str) -> None:
        self.call = call
        self.address = address


class Stream(Generic[T]):
    """Messages as they come: iterate, or wait for the last().

    Leaving its `with` block, or cancel(), ends the call; a motion that it watches ends with it. Errors of the call are
    raised where the next message would have come.
    """

    def __init__(self, source: _Source) -> None:
        self._source = source

    def __iter__(self) -> Iterator[T]:
        return self

    def __next__(self) -> T:
        try:
            message: T = next(self._source.call)
            return message
        except grpc.RpcError as error:
            raised = from_rpc(error, self._source.address)
        if isinstance(raised, Cancelled):
            raise StopIteration
        raise raised

    def last(self) -> T:
        """Waits for the end, and returns the last message. Raises the call's error, or HapticdError if none came."""
        newest: Optional[T] = None
        for newest in self:
            pass
        if newest is None:
            raise HapticdError("the stream ended without a message", where=self._source.address)
        return newest

    def cancel(self) -> None:
        self._source.call.cancel()

    def __enter__(self) -> Stream[T]:
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], value: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.cancel()


class AsyncStream(Generic[T]):
    """Stream for asyncio: `async for`, `async with`, `await last()`."""

    def __init__(self, source: _Source) -> None:
        self._source = source
        self._messages: Optional[AsyncIterator[T]] = None

    def __aiter__(self) -> AsyncStream[T]:
        return self

    async def __anext__(self) -> T:
        if self._messages is None:
            self._messages = self._source.call.__aiter__()
        try:
            return await self._messages.__anext__()
        except grpc.RpcError as error:
            raised = from_rpc(error, self._source.address)
        if isinstance(raised, Cancelled):
            raise StopAsyncIteration
        raise raised

    async def last(self) -> T:
        """Waits for the end, and returns the last message."""
        newest: Optional[T] = None
        async for newest in self:
            pass
        if newest is None:
            raise HapticdError("the stream ended without a message", where=self._source.address)
        return newest

    def cancel(self) -> None:
        self._source.call.cancel()

    async def __aenter__(self) -> AsyncStream[T]:
        return self

    async def __aexit__(
        self, kind: Optional[Type[BaseException]], value: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.cancel()
