#pragma once

#include <cstdint>
#include <vector>

#include "tests/emulators/modbus/motor.h"

namespace hapticd::test {

/// How the numbers of an emulated drive look on the wire when something is wrong with them.
struct RegisterFaults {
  bool wrong_word_order = false;
  bool nan = false;  ///< in the place of every float
};

/// What a drive says by Modbus: words and bits by address. Exceptions by their number; 0 is none.
class DriveRegisters {
 public:
  virtual ~DriveRegisters() = default;
  /// Function 3 if `input` is false, else 4.
  virtual int read_words(bool input, unsigned address, unsigned count, const EmulatedMotor& motor,
                         const RegisterFaults& faults, std::vector<std::uint16_t>& words) = 0;
  /// Function 1 if `input` is false, else 2.
  virtual int read_bits(bool input, unsigned address, unsigned count, const EmulatedMotor& motor,
                        std::vector<bool>& bits) = 0;
  virtual int write_words(unsigned address, const std::vector<std::uint16_t>& words,
                          EmulatedMotor& motor) = 0;
  virtual int write_bits(unsigned address, const std::vector<bool>& bits, EmulatedMotor& motor) = 0;
  /// Clears as a power cycle does.
  virtual void clear() = 0;
};

/// An invented drive. Input registers: 0-1 position in 0.001 deg (signed), 2-3 velocity in deg/s
/// (float), 4 status (enabled, homed, moving, in position, alarm from bit 0), 5 alarm code, 6-7 position in
/// deg (float). Holding registers: 100-101 target in 0.001 deg, 102-103 speed in deg/s (float), 104-105
/// acceleration in deg/s² (float), 106 control (enable, start, home, stop, reset; all but the first by their
/// rising edge). Discrete inputs: 0 homed, 1 moving. Coil 0: enable, 1: stop. The high word comes first.
class PlainDriveRegisters final : public DriveRegisters {
 public:
  int read_words(bool input, unsigned address, unsigned count, const EmulatedMotor& motor,
                 const RegisterFaults& faults, std::vector<std::uint16_t>& words) override;
  int read_bits(bool input, unsigned address, unsigned count, const EmulatedMotor& motor,
                std::vector<bool>& bits) override;
  int write_words(unsigned address, const std::vector<std::uint16_t>& words, EmulatedMotor& motor) override;
  int write_bits(unsigned address, const std::vector<bool>& bits, EmulatedMotor& motor) override;
  void clear() override;

 private:
  std::uint16_t holding_[7] = {};  ///< from 100 on
};

/// An Oriental Motor AZ as far as direct data operation and remote I/O go: 0x0058 … 0x0067, 0x007D, 0x007F,
/// 0x0080, 0x00CC. 10 000 steps are one turn of the table.
class AzDriveRegisters final : public DriveRegisters {
 public:
  int read_words(bool input, unsigned address, unsigned count, const EmulatedMotor& motor,
                 const RegisterFaults& faults, std::vector<std::uint16_t>& words) override;
  int read_bits(bool input, unsigned address, unsigned count, const EmulatedMotor& motor,
                std::vector<bool>& bits) override;
  int write_words(unsigned address, const std::vector<std::uint16_t>& words, EmulatedMotor& motor) override;
  int write_bits(unsigned address, const std::vector<bool>& bits, EmulatedMotor& motor) override;
  void clear() override;

 private:
  std::uint16_t direct_[16] = {};  ///< from 0x0058 on
  std::uint16_t input_ = 0;        ///< 0x007D
};

}  // namespace hapticd::test
