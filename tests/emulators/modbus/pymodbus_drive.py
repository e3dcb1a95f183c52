"""A drive made of a Modbus server of others' making: the registers of map 'plain_drive' over pymodbus.

Prints "tcp PORT" once it listens on 127.0.0.1, and serves until the one who started it is gone.
"""

import asyncio
import math
import os
import struct
import time

from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext
from pymodbus.datastore.store import BaseModbusDataBlock
from pymodbus.server.async_io import ModbusTcpServer


class Motor:
    """Goes to its target at its speed; homing sets its counter to zero."""

    def __init__(self):
        self.position, self.target, self.speed = 40.0, 40.0, 90.0
        self.enabled = self.homed = False
        self.time = time.monotonic()

    def advance(self):
        now = time.monotonic()
        most, self.time = self.speed * (now - self.time), now
        self.position += max(-most, min(most, self.target - self.position))

    def moving(self):
        return self.position != self.target


MOTOR = Motor()
PARENT = os.getppid()


def words_of(fmt, value):
    return list(struct.unpack(">HH", struct.pack(fmt, value)))


class Inputs(BaseModbusDataBlock):
    def validate(self, address, count=1):
        return 0 <= address and address + count <= 8

    def getValues(self, address, count=1):
        MOTOR.advance()
        status = (MOTOR.enabled + 2 * MOTOR.homed + 4 * MOTOR.moving() + 8 * (not MOTOR.moving()))
        velocity = math.copysign(MOTOR.speed, MOTOR.target - MOTOR.position) if MOTOR.moving() else 0.0
        words = (words_of(">i", round(MOTOR.position * 1000)) + words_of(">f", velocity) + [status, 0]
                 + words_of(">f", MOTOR.position))
        return words[address:address + count]


class Holding(BaseModbusDataBlock):
    def __init__(self):
        self.words = [0] * 7

    def validate(self, address, count=1):
        return 100 <= address and address + count <= 107

    def getValues(self, address, count=1):
        return self.words[address - 100:address - 100 + count]

    def setValues(self, address, values):
        MOTOR.advance()
        before = self.words[6]
        values = values if isinstance(values, list) else [values]
        self.words[address - 100:address - 100 + len(values)] = values
        rising = self.words[6] & ~before
        raw = struct.pack(">6H", *self.words[:6])
        MOTOR.enabled = bool(self.words[6] & 1)
        if rising & 2 and MOTOR.enabled:
            target, MOTOR.speed, _ = struct.unpack(">iff", raw)
            MOTOR.target = target / 1000.0
        if rising & 4 and MOTOR.enabled:
            MOTOR.position, MOTOR.target, MOTOR.homed = 20.0, 0.0, True
        if rising & 8:
            MOTOR.target = MOTOR.position


class Nothing(BaseModbusDataBlock):
    def validate(self, address, count=1):
        return False


async def main():
    slave = ModbusSlaveContext(di=Nothing(), co=Nothing(), hr=Holding(), ir=Inputs(), zero_mode=True)
    server = ModbusTcpServer(ModbusServerContext(slaves=slave, single=True), address=("127.0.0.1", 0))
    serving = asyncio.ensure_future(server.serve_forever())
    while server.server is None or not server.server.sockets:
        await asyncio.sleep(0.01)
        if serving.done():
            serving.result()
    print("tcp", server.server.sockets[0].getsockname()[1], flush=True)
    while os.getppid() == PARENT:
        await asyncio.sleep(0.1)


asyncio.run(main())
