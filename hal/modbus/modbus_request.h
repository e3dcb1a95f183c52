#pragma once

#include <cstddef>
#include <string>

#include "hal/modbus/register_map.h"

namespace hapticd::modbus {

/// The protocol's functions that write; those that read are 1 to 4.
inline constexpr int kWriteCoil = 5;
inline constexpr int kWriteRegister = 6;
inline constexpr int kWriteRegisters = 16;

/// One request to a drive.
struct Request {
  int function = 0;
  Table table = Table::kHolding;
  unsigned address = 0;
  std::size_t count = 0;  ///< of registers or bits
};

int read_function(Table table) noexcept;
inline bool is_read(const Request& request) noexcept {
  return request.function < kWriteCoil;
}

/// "illegal data address" for 2; empty for a code the protocol does not know.
std::string exception_name(int code);
/// Returns the remedy for an exception that answers the request.
std::string remedy_for_exception(int code, const Request& request);
/// True if the drive is there, and asks for the request again: exceptions 5 and 6.
bool asks_to_repeat(int code) noexcept;

}  // namespace hapticd::modbus
