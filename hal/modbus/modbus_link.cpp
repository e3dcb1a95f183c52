#include "hal/modbus/modbus_link.h"

#include <modbus.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <thread>

namespace hapticd::modbus {

namespace {

/// The library silently uses 9600 for any other.
constexpr std::array kBauds{1200,   2400,   4800,   9600,   19200,  38400,  57600,
                            115200, 230400, 460800, 500000, 921600, 1000000};

/// After an invalid frame, the rest of it arrives within this time.
constexpr double kFrameEndS = 0.02;

/// The drive understood, and refused.
bool is_exception(int error) {
  return error > MODBUS_ENOBASE && error < EMBBADCRC;
}

struct Free {
  void operator()(modbus_t* context) const noexcept { modbus_free(context); }
};

void set_timeout(modbus_t* context, double seconds) {
  const auto microseconds = static_cast<std::uint32_t>(std::max(seconds, 0.001) * 1e6);
  modbus_set_response_timeout(context, microseconds / 1000000U, microseconds % 1000000U);
}

const char* table_name(Table table) {
  switch (table) {
    case Table::kCoil:
      return "coil";
    case Table::kDiscreteInput:
      return "discrete input";
    case Table::kHolding:
      return "holding register";
    case Table::kInput:
      return "input register";
  }
  return "register";
}

std::string remedy_for_exception(int code) {
  switch (code) {
    case MODBUS_EXCEPTION_ILLEGAL_FUNCTION:
      return "the drive does not know this function: check the register's table in the map";
    case MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS:
      return "the drive has no such register: check its address in the map (counted from 0, not from 40001)";
    case MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE:
      return "the drive does not take this value now: check limits, unit and scale in the map";
    case MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY:
      return "the request is repeated; poll less often if it persists";
    default:
      return "look at the drive's own display and alarm";
  }
}

}  // namespace

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

std::optional<hal::Error> check(const LinkConfig& config) {
  if (config.transport == Transport::kRtu) {
    if (std::find(kBauds.begin(), kBauds.end(), config.baud) == kBauds.end()) {
      return hal::Error::of(hal::ErrorCode::kOutOfRange, "not a baud rate of a serial port",
                            "[rig.turntable.modbus] baud", std::to_string(config.baud),
                            "1200 … 1000000, a standard rate", "use the drive's setting");
    }
    if (config.unit < 1 || config.unit > 247) {
      return hal::Error::of(hal::ErrorCode::kOutOfRange, "no such unit on a serial line",
                            "[rig.turntable.modbus] unit", std::to_string(config.unit), "1 … 247",
                            "use the drive's setting");
    }
    if (config.device.empty()) {
      return hal::Error::of(hal::ErrorCode::kMissingKey, "no serial port is named",
                            "[rig.turntable.modbus] device", "", "e.g. /dev/ttyUSB0", "name it");
    }
  } else if (config.host.empty()) {
    return hal::Error::of(hal::ErrorCode::kMissingKey, "no drive is named", "[rig.turntable.modbus] host", "",
                          "a name or an address", "name it");
  }
  return std::nullopt;
}

std::string to_text(const LinkConfig& config) {
  char text[512];
  if (config.transport == Transport::kTcp) {
    std::snprintf(text, sizeof text, "tcp %.200s:%d, unit %d", config.host.c_str(), config.port, config.unit);
  } else {
    std::snprintf(text, sizeof text, "rtu %.200s, %d %d%c%d, unit %d", config.device.c_str(), config.baud,
                  config.data_bits, config.parity, config.stop_bits, config.unit);
  }
  return text;
}

struct ModbusLink::State {
  explicit State(const LinkConfig& given) : config(given), place("turntable, " + to_text(given)) {}

  LinkConfig config;
  std::string place;
  std::unique_ptr<modbus_t, Free> context;
  bool connected = false;
  LinkCounts counts;

  /// What errno means after a failed exchange.
  hal::Error explain(int error, Table table, unsigned address) {
    hal::Error reported;
    char what[96];
    std::snprintf(what, sizeof what, ", %s 0x%04X", table_name(table), address);
    reported.where = place + what;
    if (error == ETIMEDOUT) {
      ++counts.timeouts;
      reported.what = "the drive did not answer in time";
      char limit[48];
      std::snprintf(limit, sizeof limit, "%.3g s", config.response_timeout_s);
      reported.limit = limit;
      reported.remedy = config.transport == Transport::kRtu
                            ? "check wiring, speed, parity and unit"
                            : "check that the drive is on, or allow more time";
    } else if (is_exception(error)) {
      const int code = error - MODBUS_ENOBASE;
      ++counts.exceptions;
      reported.what = "the drive refused: " + exception_name(code);
      reported.value = "exception " + std::to_string(code);
      reported.remedy = remedy_for_exception(code);
    } else if (error == EMBBADCRC || error == EMBBADDATA || error == EMBBADEXC || error == EMBMDATA ||
               error == EMBUNKEXC || error == EMBBADSLAVE) {
      ++counts.bad_frames;
      reported.what = "the drive's answer is not valid";
      reported.value = modbus_strerror(error);
      reported.remedy = config.transport == Transport::kRtu ? "check shielding, termination, speed and parity"
                                                            : "check that a Modbus server listens there";
    } else {
      ++counts.broken;
      connected = false;
      reported.what = "the connection to the drive broke";
      reported.value = std::strerror(error);
      reported.remedy = "it is connected again by itself; check the drive's power and the cable";
    }
    return reported;
  }

  /// A late answer must not be taken for that to the next request. Over TCP its transaction shows; on a
  /// serial line nothing does but silence, so that one is waited for.
  std::optional<hal::Error> failed(int error, Table table, unsigned address) {
    hal::Error reported = explain(error, table, address);
    if (!connected) return reported;
    if (config.transport == Transport::kRtu && !is_exception(error)) {
      const double wait_s = error == ETIMEDOUT ? config.response_timeout_s : kFrameEndS;
      std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
    }
    modbus_flush(context.get());
    return reported;
  }
};

ModbusLink::ModbusLink(const LinkConfig& config) : state_(std::make_unique<State>(config)) {}

ModbusLink::~ModbusLink() {
  close();
}

const LinkCounts& ModbusLink::counts() const noexcept {
  return state_->counts;
}

bool ModbusLink::linked() const noexcept {
  return state_->connected;
}

void ModbusLink::close() noexcept {
  State& s = *state_;
  if (s.context) modbus_close(s.context.get());
  s.context.reset();
  s.connected = false;
}

std::optional<hal::Error> ModbusLink::open() {
  close();
  State& s = *state_;
  const LinkConfig& config = s.config;
  if (config.transport == Transport::kTcp) {
    s.context.reset(modbus_new_tcp_pi(config.host.c_str(), std::to_string(config.port).c_str()));
  } else {
    s.context.reset(modbus_new_rtu(config.device.c_str(), config.baud, config.parity, config.data_bits,
                                   config.stop_bits));
  }
  if (!s.context || modbus_set_slave(s.context.get(), config.unit) != 0) {
    return hal::Error{"no such connection", s.place, std::strerror(errno), "",
                      "correct [rig.turntable.modbus]"};
  }
  modbus_t* context = s.context.get();
  modbus_set_error_recovery(context, MODBUS_ERROR_RECOVERY_NONE);
  set_timeout(context, config.connect_timeout_s);
  if (modbus_connect(context) != 0) {
    const int error = errno;
    ++s.counts.broken;
    s.context.reset();
    return hal::Error{"cannot connect to the drive", s.place, std::strerror(error), "",
                      config.transport == Transport::kRtu
                          ? "check that the port exists, may be read and written, and is used by nothing else"
                          : "check address, port and power of the drive; many drives serve one client only"};
  }
  s.connected = true;
  set_timeout(context, config.response_timeout_s);
  // Without a timeout between bytes the response timeout holds for the whole answer.
  modbus_set_byte_timeout(context, 0, 0);
  if (config.transport == Transport::kRtu && config.rs485 &&
      modbus_rtu_set_serial_mode(context, MODBUS_RTU_RS485) != 0) {
    const int error = errno;
    close();
    return hal::Error{"the serial port cannot switch direction for RS-485", s.place, std::strerror(error), "",
                      "set rs485 = false: most adapters switch by themselves"};
  }
  modbus_flush(context);
  return std::nullopt;
}

std::optional<hal::Error> ModbusLink::read(const ReadBlock& block, std::vector<std::uint16_t>& words) {
  State& s = *state_;
  if (!s.connected) return s.explain(ENOTCONN, block.table, block.address);
  words.assign(block.count, 0);
  ++s.counts.requests;
  int got = -1;
  errno = 0;
  if (block.table == Table::kHolding) {
    got = modbus_read_registers(s.context.get(), block.address, block.count, words.data());
  } else if (block.table == Table::kInput) {
    got = modbus_read_input_registers(s.context.get(), block.address, block.count, words.data());
  } else {
    std::vector<std::uint8_t> bits(block.count, 0);
    got = block.table == Table::kCoil
              ? modbus_read_bits(s.context.get(), block.address, block.count, bits.data())
              : modbus_read_input_bits(s.context.get(), block.address, block.count, bits.data());
    std::copy(bits.begin(), bits.end(), words.begin());
  }
  if (got == block.count) return std::nullopt;
  return s.failed(errno != 0 ? errno : EMBBADDATA, block.table, block.address);
}

std::optional<hal::Error> ModbusLink::write(const Register& target, std::span<const std::uint16_t> words) {
  State& s = *state_;
  if (!s.connected) return s.explain(ENOTCONN, target.table, target.address);
  ++s.counts.requests;
  errno = 0;
  int done = -1;
  if (target.table == Table::kCoil) {
    done = modbus_write_bit(s.context.get(), target.address, words[0] != 0 ? 1 : 0);
  } else if (words.size() == 1) {
    done = modbus_write_register(s.context.get(), target.address, words[0]);
  } else {
    done =
        modbus_write_registers(s.context.get(), target.address, static_cast<int>(words.size()), words.data());
  }
  if (done >= 1) return std::nullopt;
  return s.failed(errno != 0 ? errno : EMBBADDATA, target.table, target.address);
}

}  // namespace hapticd::modbus
