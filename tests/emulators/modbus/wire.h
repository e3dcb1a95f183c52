#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tests/emulators/modbus/drive_registers.h"

namespace hapticd::test {

using Bytes = std::vector<std::uint8_t>;

/// Answers one request (function and data, without address and check) as the application protocol wants it.
Bytes answer(const Bytes& request, DriveRegisters& registers, EmulatedMotor& motor,
             const RegisterFaults& faults);
/// An exception's answer.
Bytes refusal(const Bytes& request, int code);

/// CRC-16 of the serial line, low byte first on the wire.
std::uint16_t crc16(const Bytes& bytes);

/// How long a request on the serial line is, address and CRC included, as far as its beginning shows; nothing
/// while it shows too little.
std::optional<std::size_t> serial_request_length(const Bytes& received);

}  // namespace hapticd::test
