#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/modbus/register_map.h"

namespace hapticd::modbus {

enum class Transport : std::uint8_t { kTcp, kRtu };

/// Address of the drive and timeouts.
struct LinkConfig {
  Transport transport = Transport::kTcp;
  std::string host = "192.168.1.20";  ///< name or address, IPv4 or IPv6
  int port = 502;
  std::string device = "/dev/ttyUSB0";  ///< serial port
  int baud = 115200;
  char parity = 'E';  ///< 'N', 'E' or 'O'; the protocol's own is even
  int data_bits = 8;
  int stop_bits = 1;
  bool rs485 = false;               ///< have the kernel switch the direction of an RS-485 port
  int unit = 1;                     ///< the drive's number on the line; over TCP usually ignored
  double response_timeout_s = 0.2;  ///< for a whole answer, from its request
  double connect_timeout_s = 1.0;
  friend bool operator==(const LinkConfig&, const LinkConfig&) = default;
};

std::optional<hal::Error> check(const LinkConfig& config);
/// Text such as "tcp 192.168.1.20:502, unit 1" or "rtu /dev/ttyUSB0, 115200 8E1, unit 1".
std::string to_text(const LinkConfig& config);

/// What went wrong on the line, by kind.
struct LinkCounts {
  std::uint64_t requests = 0;
  std::uint64_t timeouts = 0;
  std::uint64_t exceptions = 0;    ///< the drive refused a request
  std::uint64_t bad_frames = 0;    ///< CRC, transaction, length or unit wrong
  std::uint64_t broken = 0;        ///< connections that broke or could not be made
  std::uint64_t late_answers = 0;  ///< over TCP: answers to earlier requests, discarded
};

/// Requests and answers, on a serial line by libmodbus. For one thread; a call takes at most its timeout,
/// however slowly bytes arrive. What comes late is discarded. An error with the code kBusy is an answer: the
/// drive is there, and takes the request later.
class ModbusLink {
 public:
  explicit ModbusLink(const LinkConfig& config);
  ~ModbusLink();
  ModbusLink(const ModbusLink&) = delete;
  ModbusLink& operator=(const ModbusLink&) = delete;

  std::optional<hal::Error> open();
  void close() noexcept;
  /// False once the connection broke.
  bool linked() const noexcept;

  std::optional<hal::Error> read(const ReadBlock& block, std::vector<std::uint16_t>& words);
  /// Writes one word by function 5 or 6, two by function 16.
  std::optional<hal::Error> write(const Register& target, std::span<const std::uint16_t> words);

  const LinkCounts& counts() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::modbus
