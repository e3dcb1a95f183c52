#include "hal/modbus/modbus_request.h"

#include <modbus.h>

namespace hapticd::modbus {

int read_function(Table table) noexcept {
  switch (table) {
    case Table::kCoil:
      return 1;
    case Table::kDiscreteInput:
      return 2;
    case Table::kHolding:
      return 3;
    case Table::kInput:
      return 4;
  }
  return 3;
}

std::string exception_name(int code) {
  switch (code) {
    case MODBUS_EXCEPTION_ILLEGAL_FUNCTION:
      return "illegal function";
    case MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS:
      return "illegal data address";
    case MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE:
      return "illegal data value";
    case MODBUS_EXCEPTION_SLAVE_OR_SERVER_FAILURE:
      return "server device failure";
    case MODBUS_EXCEPTION_ACKNOWLEDGE:
      return "acknowledge, still at work";
    case MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY:
      return "server device busy";
    case MODBUS_EXCEPTION_NEGATIVE_ACKNOWLEDGE:
      return "negative acknowledge";
    case MODBUS_EXCEPTION_MEMORY_PARITY:
      return "memory parity error";
    case MODBUS_EXCEPTION_GATEWAY_PATH:
      return "gateway path unavailable";
    case MODBUS_EXCEPTION_GATEWAY_TARGET:
      return "gateway target did not respond";
    default:
      return {};
  }
}

std::string remedy_for_exception(int code, const Request& request) {
  const std::string count = std::to_string(request.count);
  switch (code) {
    case MODBUS_EXCEPTION_ILLEGAL_FUNCTION:
      if (request.function == kWriteRegisters) {
        return "the drive cannot write " + count +
               " registers at once (function 16), which a 32-bit number needs: use its 16-bit registers in "
               "the map, if it has them";
      }
      return "the drive does not know function " + std::to_string(request.function) +
             ": check the register's table in the map";
    case MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS:
    case MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE:
      if (is_read(request) && request.count > 1) {
        return "check the addresses in the map (counted from 0, not from 40001); a drive that does not "
               "read " +
               count + " registers at once needs max_registers_per_read in the map";
      }
      if (code == MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE)
        return "the drive does not take this value now: check limits, unit and scale in the map";
      return "the drive has no such register: check its address in the map (counted from 0, not from 40001)";
    case MODBUS_EXCEPTION_ACKNOWLEDGE:
    case MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY:
      return "the request is repeated at the next poll; poll less often if it persists";
    default:
      return "look at the drive's own display and alarm";
  }
}

bool asks_to_repeat(int code) noexcept {
  return code == MODBUS_EXCEPTION_ACKNOWLEDGE || code == MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY;
}

}  // namespace hapticd::modbus
