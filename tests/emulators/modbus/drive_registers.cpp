#include "tests/emulators/modbus/drive_registers.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace hapticd::test {

namespace {

constexpr int kIllegalFunction = 1;
constexpr int kIllegalAddress = 2;
constexpr int kIllegalValue = 3;
constexpr double kAzStepsPerDeg = 10000.0 / 360.0;

void put(std::vector<std::uint16_t>& words, std::uint32_t bits, bool swapped) {
  const auto high = static_cast<std::uint16_t>(bits / 65536U);
  const auto low = static_cast<std::uint16_t>(bits % 65536U);
  words.push_back(swapped ? low : high);
  words.push_back(swapped ? high : low);
}

std::uint32_t joined(const std::uint16_t* words) {
  return words[0] * 65536U + words[1];
}

std::uint32_t count_of(double value) {
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(value)));
}

double signed_of(std::uint32_t bits) {
  return bits < 0x80000000U ? static_cast<double>(bits) : static_cast<double>(bits) - 4294967296.0;
}

std::uint32_t float_bits(double value) {
  const auto narrow = static_cast<float>(value);
  std::uint32_t bits = 0;
  std::memcpy(&bits, &narrow, sizeof bits);
  return bits;
}

double float_of(std::uint32_t bits) {
  float narrow = 0.0F;
  std::memcpy(&narrow, &bits, sizeof narrow);
  return static_cast<double>(narrow);
}

/// Returns `count` of `all` from `from` on; 2 if there are not so many.
template <class T>
int excerpt(const std::vector<T>& all, unsigned first, unsigned address, unsigned count,
            std::vector<T>& out) {
  if (address < first || address + count > first + all.size()) return kIllegalAddress;
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(address - first);
  out.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
  return 0;
}

}  // namespace

int PlainDriveRegisters::read_words(bool input, unsigned address, unsigned count, const EmulatedMotor& motor,
                                    const RegisterFaults& faults, std::vector<std::uint16_t>& words) {
  if (!input)
    return excerpt(std::vector<std::uint16_t>(std::begin(holding_), std::end(holding_)), 100, address, count,
                   words);
  constexpr std::uint32_t kNan = 0x7FC00000U;
  std::vector<std::uint16_t> all;
  put(all, count_of(motor.counter_deg() * 1000.0), faults.wrong_word_order);
  put(all, faults.nan ? kNan : float_bits(motor.velocity_deg_per_s()), faults.wrong_word_order);
  all.push_back(static_cast<std::uint16_t>((motor.enabled() ? 1 : 0) + (motor.homed() ? 2 : 0) +
                                           (motor.moving() ? 4 : 0) + (motor.in_position() ? 8 : 0) +
                                           (motor.alarm() != 0 ? 16 : 0)));
  all.push_back(motor.alarm());
  put(all, faults.nan ? kNan : float_bits(motor.counter_deg()), faults.wrong_word_order);
  return excerpt(all, 0, address, count, words);
}

int PlainDriveRegisters::read_bits(bool input, unsigned address, unsigned count, const EmulatedMotor& motor,
                                   std::vector<bool>& bits) {
  if (input) return excerpt(std::vector<bool>{motor.homed(), motor.moving()}, 0, address, count, bits);
  return excerpt(std::vector<bool>{motor.enabled(), false}, 0, address, count, bits);
}

int PlainDriveRegisters::write_words(unsigned address, const std::vector<std::uint16_t>& words,
                                     EmulatedMotor& motor) {
  if (address < 100 || address + words.size() > 107) return kIllegalAddress;
  const std::uint16_t before = holding_[6];
  std::copy(words.begin(), words.end(), holding_ + (address - 100));
  const std::uint16_t now = holding_[6];
  const unsigned rising = now & ~unsigned{before};
  if (((now ^ before) & 1U) != 0) motor.enable((now & 1U) != 0);
  if ((rising & 2U) != 0) {
    const double speed = float_of(joined(holding_ + 2));
    if (!(speed > 0.0)) return kIllegalValue;
    motor.set_limits(speed, float_of(joined(holding_ + 4)));
    motor.start(signed_of(joined(holding_)) / 1000.0);
  }
  if ((rising & 4U) != 0) motor.home();
  if ((rising & 8U) != 0) motor.stop();
  if ((rising & 16U) != 0) {
    motor.reset();
    motor.enable((now & 1U) != 0);
  }
  return 0;
}

int PlainDriveRegisters::write_bits(unsigned address, const std::vector<bool>& bits, EmulatedMotor& motor) {
  if (address + bits.size() > 2) return kIllegalAddress;
  for (std::size_t i = 0; i < bits.size(); ++i) {
    if (address + i == 0) motor.enable(bits[i]);
    if (address + i == 1 && bits[i]) motor.stop();
  }
  return 0;
}

void PlainDriveRegisters::clear() {
  std::fill(std::begin(holding_), std::end(holding_), std::uint16_t{0});
}

int AzDriveRegisters::read_words(bool input, unsigned address, unsigned count, const EmulatedMotor& motor,
                                 const RegisterFaults& faults, std::vector<std::uint16_t>& words) {
  if (input) return kIllegalFunction;  // it knows function 3 only
  std::vector<std::uint16_t> all;
  if (address >= 0xCC) {
    put(all, count_of(motor.counter_deg() * kAzStepsPerDeg), faults.wrong_word_order);
    return excerpt(all, 0xCC, address, count, words);
  }
  if (address >= 0x7F) {
    all.push_back(static_cast<std::uint16_t>((motor.homed() ? 0x10 : 0) +
                                             (motor.enabled() && !motor.moving() ? 0x20 : 0) +
                                             (motor.alarm() != 0 ? 0x80 : 0) + (motor.moving() ? 0x2000 : 0) +
                                             (motor.in_position() ? 0x4000 : 0)));
    put(all, motor.alarm(), faults.wrong_word_order);
    return excerpt(all, 0x7F, address, count, words);
  }
  if (address >= 0x7C) return excerpt(std::vector<std::uint16_t>{0, input_, 0}, 0x7C, address, count, words);
  return excerpt(std::vector<std::uint16_t>(std::begin(direct_), std::end(direct_)), 0x58, address, count,
                 words);
}

int AzDriveRegisters::read_bits(bool, unsigned, unsigned, const EmulatedMotor&, std::vector<bool>&) {
  return kIllegalFunction;
}

int AzDriveRegisters::write_bits(unsigned, const std::vector<bool>&, EmulatedMotor&) {
  return kIllegalFunction;
}

int AzDriveRegisters::write_words(unsigned address, const std::vector<std::uint16_t>& words,
                                  EmulatedMotor& motor) {
  if (address == 0x7C || address == 0x7D) {
    if (address + words.size() > 0x7E) return kIllegalAddress;
    const std::uint16_t before = input_;
    input_ = words.back();
    const unsigned rising = input_ & ~unsigned{before};
    if ((rising & 0x10U) != 0) motor.home();
    if ((rising & 0x20U) != 0) motor.stop();
    if ((rising & 0x80U) != 0) {
      motor.reset();
      motor.enable(true);
    }
    return 0;
  }
  if (address < 0x58 || address + words.size() > 0x68) return kIllegalAddress;
  std::copy(words.begin(), words.end(), direct_ + (address - 0x58));
  const bool triggered = address <= 0x67 && address + words.size() > 0x67 && joined(direct_ + 14) == 1;
  if (!triggered) return 0;
  if (joined(direct_ + 2) != 1) return kIllegalValue;  // absolute positioning is all it does
  motor.set_limits(joined(direct_ + 6) / kAzStepsPerDeg, joined(direct_ + 8) / kAzStepsPerDeg);
  motor.start(signed_of(joined(direct_ + 4)) / kAzStepsPerDeg);
  return 0;
}

void AzDriveRegisters::clear() {
  std::fill(std::begin(direct_), std::end(direct_), std::uint16_t{0});
  input_ = 0;
}

}  // namespace hapticd::test
