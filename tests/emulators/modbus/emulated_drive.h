#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "tests/emulators/modbus/motor.h"

namespace hapticd::test {

/// What goes wrong between drive and master, until it is set otherwise.
struct DriveFaults {
  int exception = 0;           ///< every request is refused with this code
  int exception_on_write = 0;  ///< the same for writes only
  int delay_ms = 0;            ///< before every answer
  int delay_once_ms = 0;       ///< before the next answer only
  bool silent = false;         ///< half-open: takes requests, never answers
  bool hang_up = false;        ///< closes the connection instead of answering
  bool garbage = false;        ///< bytes of no meaning in the place of answers
  bool truncated = false;      ///< half of every answer
  bool wrong_check = false;    ///< a wrong CRC; over TCP a wrong transaction
  bool wrong_unit = false;     ///< answers in another unit's name
  bool refuse_connections = false;
  bool wrong_word_order = false;
  bool nan = false;
};

/// A motor drive behind Modbus, over TCP on the loopback interface and over one end of a pty pair: with its
/// own protocol, registers and mechanics.
class EmulatedDrive {
 public:
  enum class Make { kPlain, kOrientalAz };
  struct Options {
    Make make = Make::kPlain;
    int unit = 1;
    int tcp_port = 0;  ///< 0 = any free one; negative = none
    bool serial = false;
  };
  explicit EmulatedDrive(const Options& options);
  ~EmulatedDrive();
  EmulatedDrive(const EmulatedDrive&) = delete;
  EmulatedDrive& operator=(const EmulatedDrive&) = delete;

  int port() const;
  /// Path of the port a master opens.
  std::string serial_port() const;

  void set_faults(const DriveFaults& faults);
  /// The motor as it is now; changes through the functions below.
  EmulatedMotor motor() const;
  void raise_alarm(std::uint16_t code);
  void hold(bool held);
  void turn_by_hand(double degrees);
  /// A power cycle: connections break, counter and homing are lost.
  void restart();
  /// Requests since the beginning, and how many masters are connected now.
  std::uint64_t requests() const;
  int connections() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::test
