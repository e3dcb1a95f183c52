#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/modbus/register_codec.h"
#include "hal/modbus/units.h"
#include "hal/turntable/drive.h"

namespace hapticd::modbus {

/// The four tables of the protocol. Coils and holding registers can be written.
enum class Table : std::uint8_t { kCoil, kDiscreteInput, kHolding, kInput };

/// One number of the drive.
struct Register {
  std::string name;  ///< used by conditions, figures and commands
  Table table = Table::kHolding;
  std::uint16_t address = 0;  ///< as sent on the wire, counted from 0
  NumberFormat format;
  Unit unit = Unit::kNone;
  double scale = 1.0;  ///< quantity = number × scale + offset, in the unit
  double offset = 0.0;
  friend bool operator==(const Register&, const Register&) = default;
};

/// A condition on a register: of the masked bits, exactly those of `equals` are set.
struct Condition {
  std::size_t register_index = 0;
  std::uint32_t mask = 1;
  std::uint32_t equals = 1;
  bool negated = false;
  friend bool operator==(const Condition&, const Condition&) = default;
};

/// One write of a command.
struct Step {
  enum class Kind : std::uint8_t {
    kValue,   ///< the register becomes `value`
    kSet,     ///< the bits of `value` are set; the others stay as last written by us
    kClear,   ///< the bits of `value` are cleared
    kTarget,  ///< the motion's target angle
    kSpeed,   ///< its limits
    kAcceleration,
  };
  std::size_t register_index = 0;
  Kind kind = Kind::kValue;
  std::uint32_t value = 0;
  double then_wait_s = 0.0;  ///< before the next step, e.g. for an edge to be seen
  friend bool operator==(const Step&, const Step&) = default;
};
using Sequence = std::vector<Step>;

/// The registers of a drive and their meaning: everything specific to a make of drive. A new make needs no
/// code.
struct RegisterMap {
  std::string name;    ///< e.g. "oriental_az"
  std::string source;  ///< where the addresses come from
  std::vector<Register> registers;
  /// Some drives read fewer at once than the protocol allows.
  std::uint16_t max_registers_per_read = 125;

  std::size_t position_actual = 0;  ///< index of the register
  std::optional<std::size_t> velocity_actual;
  std::optional<std::size_t> alarm_code;
  std::optional<Condition> homed;  ///< absent: see always_homed
  std::optional<Condition> moving;
  std::optional<Condition> in_position;
  std::optional<Condition> alarm;  ///< absent: an alarm code other than 0
  bool always_homed = false;       ///< an absolute encoder, which needs no homing

  Sequence setup;  ///< once after connecting: mode, enable
  Sequence start;  ///< to the target, within the limits
  Sequence home;
  Sequence stop;
  Sequence reset;  ///< an alarm
  Sequence
      release;  ///< before the connection is closed; usually nothing, so that the table holds its position
  std::map<std::uint32_t, std::string> alarm_texts;

  friend bool operator==(const RegisterMap&, const RegisterMap&) = default;
};

/// Checks a map: an error if it contradicts itself or lacks something that every turntable needs.
std::optional<hal::Error> check(const RegisterMap& map);

/// Adjacent words of one table, read in one request.
struct ReadBlock {
  Table table = Table::kHolding;
  std::uint16_t address = 0;
  std::uint16_t count = 0;
  friend bool operator==(const ReadBlock&, const ReadBlock&) = default;
};
/// Blocks to read for position and status: adjacent registers in one request, and no other registers.
std::vector<ReadBlock> read_plan(const RegisterMap& map);

/// The answers to a plan, block by block.
using BlockWords = std::vector<std::vector<std::uint16_t>>;
/// Words of register `wanted` among the answers; empty if they are not there.
std::span<const std::uint16_t> words_in(const Register& wanted, std::span<const ReadBlock> plan,
                                        const BlockWords& words);
/// Converts the answers, in deg and deg/s. A position or velocity that is not finite is passed on: the
/// caller checks it.
turntable::DriveReading interpret(const RegisterMap& map, const Gear& gear, std::span<const ReadBlock> plan,
                                  const BlockWords& words);
/// Names another word or byte order in which the position would be within the range (deg); empty if there
/// is none.
std::string hint_of_order(const RegisterMap& map, const Gear& gear, std::span<const ReadBlock> plan,
                          const BlockWords& words, double min_deg, double max_deg);

}  // namespace hapticd::modbus
