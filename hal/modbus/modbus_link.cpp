#include "hal/modbus/modbus_link.h"

#include <modbus.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <thread>

#include "hal/modbus/modbus_request.h"
#include "hal/modbus/tcp_exchange.h"

namespace hapticd::modbus {

namespace {

/// The library silently uses 9600 for any other.
constexpr std::array kBauds{1200,   2400,   4800,   9600,   19200,  38400,  57600,
                            115200, 230400, 460800, 500000, 921600, 1000000};

/// Time within which the rest of an invalid frame arrives.
constexpr double kFrameEndS = 0.02;

/// True if the drive understood, and refused.
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

}  // namespace

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
  TcpExchange tcp;
  bool connected = false;
  LinkCounts counts;

  /// Explains errno after a failed exchange.
  hal::Error explain(int error, const Request& request) {
    hal::Error reported;
    char what[96];
    std::snprintf(what, sizeof what, ", %s 0x%04X", table_name(request.table), request.address);
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
      reported.remedy = remedy_for_exception(code, request);
      if (asks_to_repeat(code)) reported.code = hal::ErrorCode::kBusy;
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

  /// Error of a failed exchange. A late answer must not be taken for that to the next request. Over TCP its
  /// transaction shows; on a serial line nothing does but silence, so that one is waited for.
  hal::Error failed(int error, const Request& request) {
    hal::Error reported = explain(error, request);
    if (!connected || config.transport == Transport::kTcp) return reported;
    if (!is_exception(error)) {
      const double wait_s = error == ETIMEDOUT ? config.response_timeout_s : kFrameEndS;
      std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
    }
    modbus_flush(context.get());
    return reported;
  }

  /// Exchanges over TCP. Returns 0 or an errno, those of libmodbus included.
  int exchange(const Request& request, std::span<const std::uint16_t> words, TcpExchange::Bytes& answer) {
    TcpExchange::Bytes bytes{static_cast<std::uint8_t>(request.function)};
    const auto append = [&bytes](std::size_t number) {
      bytes.push_back(static_cast<std::uint8_t>(number >> 8U));
      bytes.push_back(static_cast<std::uint8_t>(number));
    };
    append(request.address);
    if (is_read(request) || request.function == kWriteRegisters) append(request.count);
    if (request.function == kWriteRegisters) bytes.push_back(static_cast<std::uint8_t>(2 * words.size()));
    for (const std::uint16_t word : words) append(word);
    const int error =
        tcp.exchange(modbus_get_socket(context.get()), config.unit, bytes, config.response_timeout_s, answer);
    counts.late_answers = tcp.late_answers();
    if (error != 0) return error;
    const int function = answer[0];
    if (function == (request.function | 0x80) && answer.size() >= 2)
      return exception_name(answer[1]).empty() ? EMBUNKEXC : MODBUS_ENOBASE + answer[1];
    return function == request.function ? 0 : EMBBADDATA;
  }

  int read_over_tcp(const Request& request, std::vector<std::uint16_t>& words) {
    TcpExchange::Bytes answer;
    if (const int error = exchange(request, {}, answer)) return error;
    const bool is_bits = request.table == Table::kCoil || request.table == Table::kDiscreteInput;
    const std::size_t size = is_bits ? (request.count + 7) / 8 : 2 * request.count;
    if (answer.size() != 2 + size || answer[1] != size) return EMBBADDATA;
    for (std::size_t i = 0; i < request.count; ++i) {
      words[i] = static_cast<std::uint16_t>(is_bits ? answer[2 + i / 8] >> (i % 8) & 1U
                                                    : answer[2 + 2 * i] * 256U + answer[3 + 2 * i]);
    }
    return 0;
  }

  int write_over_tcp(const Request& request, std::span<const std::uint16_t> words) {
    constexpr std::size_t kEchoSize = 5;
    TcpExchange::Bytes answer;
    if (const int error = exchange(request, words, answer)) return error;
    return answer.size() == kEchoSize ? 0 : EMBBADDATA;
  }

  int read_over_serial_line(const Request& request, std::vector<std::uint16_t>& words) {
    const int address = static_cast<int>(request.address);
    const int count = static_cast<int>(request.count);
    errno = 0;
    int got = -1;
    if (request.table == Table::kHolding) {
      got = modbus_read_registers(context.get(), address, count, words.data());
    } else if (request.table == Table::kInput) {
      got = modbus_read_input_registers(context.get(), address, count, words.data());
    } else {
      std::vector<std::uint8_t> bits(request.count, 0);
      got = request.table == Table::kCoil
                ? modbus_read_bits(context.get(), address, count, bits.data())
                : modbus_read_input_bits(context.get(), address, count, bits.data());
      std::copy(bits.begin(), bits.end(), words.begin());
    }
    if (got == count) return 0;
    return errno != 0 ? errno : EMBBADDATA;
  }

  int write_over_serial_line(const Request& request, std::span<const std::uint16_t> words) {
    const int address = static_cast<int>(request.address);
    errno = 0;
    int done = -1;
    if (request.function == kWriteCoil) {
      done = modbus_write_bit(context.get(), address, words[0] != 0 ? 1 : 0);
    } else if (request.function == kWriteRegister) {
      done = modbus_write_register(context.get(), address, words[0]);
    } else {
      done = modbus_write_registers(context.get(), address, static_cast<int>(words.size()), words.data());
    }
    if (done >= 1) return 0;
    return errno != 0 ? errno : EMBBADDATA;
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
  s.tcp.reset();
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
  const Request request{read_function(block.table), block.table, block.address, block.count};
  if (!s.connected) return s.explain(ENOTCONN, request);
  words.assign(block.count, 0);
  ++s.counts.requests;
  const int error = s.config.transport == Transport::kTcp ? s.read_over_tcp(request, words)
                                                          : s.read_over_serial_line(request, words);
  if (error == 0) return std::nullopt;
  return s.failed(error, request);
}

std::optional<hal::Error> ModbusLink::write(const Register& target, std::span<const std::uint16_t> words) {
  State& s = *state_;
  const bool is_coil = target.table == Table::kCoil;
  const int function = is_coil ? kWriteCoil : words.size() == 1 ? kWriteRegister : kWriteRegisters;
  const Request request{function, target.table, target.address, words.size()};
  if (!s.connected) return s.explain(ENOTCONN, request);
  ++s.counts.requests;
  if (s.config.transport == Transport::kRtu) {
    const int error = s.write_over_serial_line(request, words);
    if (error == 0) return std::nullopt;
    return s.failed(error, request);
  }
  // On the wire a coil that is on is 0xFF00.
  const std::uint16_t coil = words[0] != 0 ? 0xFF00 : 0;
  const int error = s.write_over_tcp(request, is_coil ? std::span(&coil, 1) : words);
  if (error == 0) return std::nullopt;
  return s.failed(error, request);
}

}  // namespace hapticd::modbus
