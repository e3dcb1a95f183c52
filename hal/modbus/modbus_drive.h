#pragma once

#include <array>
#include <atomic>
#include <vector>

#include "hal/modbus/modbus_turntable.h"
#include "hal/turntable/drive.h"

namespace hapticd::modbus {

/// A drive described by its register map.
class ModbusDrive final : public turntable::Drive {
 public:
  /// Makes a drive. The range (deg) is used for hints in errors only.
  ModbusDrive(const ModbusConfig& config, double min_deg, double max_deg);

  std::optional<hal::Error> open() override;
  void close() noexcept override;
  bool linked() const noexcept override { return link_.linked(); }
  hal::Result<turntable::DriveReading> read() override;
  std::optional<hal::Error> start_move(double target_deg, const hal::MotionLimits& limits) override;
  std::optional<hal::Error> start_home() override;
  std::optional<hal::Error> stop() override;
  std::optional<hal::Error> reset_alarm() override;
  std::string hint_for_implausible() const override;
  std::string driver() const override { return "modbus"; }
  std::string connection() const override;
  std::string alarm_text(std::uint32_t code) const override;
  std::vector<hal::PartFigure> figures() const override;

 private:
  struct Quantities {
    double target_deg = 0.0;
    hal::MotionLimits limits;
  };
  std::optional<hal::Error> perform(const Sequence& sequence, const Quantities& quantities);
  std::optional<hal::Error> perform(const Sequence& sequence) { return perform(sequence, Quantities()); }
  std::optional<hal::Error> write(const Step& step, const Quantities& quantities);
  void publish_counts() noexcept;

  const ModbusConfig config_;
  const double min_deg_;
  const double max_deg_;
  const std::vector<ReadBlock> plan_;
  ModbusLink link_;
  bool setup_is_due_ = false;           ///< the drive was too busy for it: done before the next reading
  BlockWords words_;                    ///< of the last reading
  std::vector<std::uint32_t> written_;  ///< by register: the value last written by this object
  std::array<std::atomic<std::uint64_t>, 6> counts_{};  ///< of the link, for other threads
};

}  // namespace hapticd::modbus
