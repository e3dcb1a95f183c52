#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "hal/rig.h"
#include "hal/tip_instrument.h"

namespace hapticd::hal {

/// The parts of a rig. A missing part is taken from the base; without a base it is absent.
struct RigParts {
  std::unique_ptr<Rig> base;  ///< simulated or replayed in real time; may be null
  std::unique_ptr<HapticDevice> device;
  std::unique_ptr<ForceSensor> sensor;
  std::unique_ptr<TipInstrument> instrument{};  ///< optional; measures the tip of `device`
};

/// A real device and/or a real sensor; a missing part is taken from a simulated or replayed rig. If there
/// is a real device, the force goes to it only.
class ComposedRig final : public Rig, public InstrumentedRig {
 public:
  /// `rate_hz` of the tick. Opens nothing. The base must not own its clock.
  ComposedRig(RigParts parts, double rate_hz);
  ~ComposedRig() override;

  const RigInfo& info() const noexcept override { return info_; }
  bool owns_clock() const noexcept override { return false; }
  ServoClock* clock() noexcept override { return parts_.device ? parts_.device->clock() : nullptr; }
  /// Engage the device for the first time before any other thread reads info(): this call may change it.
  std::optional<Error> engage(RigPartKind part) override;
  void disengage(RigPartKind part) noexcept override;
  std::vector<PartReport> reports() const override;
  std::optional<Error> bias_force_sensor() override;
  std::optional<Error> home_device() override;
  void read(RigSample& sample) noexcept override;
  void write(const DeviceCommand& command) noexcept override;
  void write_zero_in_crash() noexcept override;
  bool exhausted() const noexcept override { return parts_.base && parts_.base->exhausted(); }

  std::optional<Error> engage_instrument() override;
  void disengage_instrument() noexcept override;
  /// The instrument's reading at the last sample, mm; axes that it does not measure come from the encoders.
  bool external_position(Vector3& position_mm) const noexcept override;

  Rig* base() noexcept { return parts_.base.get(); }

 private:
  using Clock = std::chrono::steady_clock;

  /// Whether the clock's thread may read a part. Releasing the hardware waits for a read in progress.
  class Access {
   public:
    void open() noexcept { open_.store(true); }
    /// Returns when no read is in progress.
    void close() noexcept;
    /// Runs `use` unless closed; on the clock's thread.
    template <class Use>
    bool with(Use use) noexcept {
      in_use_.store(true);
      const bool open = open_.load();
      if (open) use();
      in_use_.store(false, std::memory_order_release);
      return open;
    }

   private:
    std::atomic<bool> open_{false};
    std::atomic<bool> in_use_{false};
  };

  RigParts parts_;
  RigInfo info_;
  bool device_reported_ = false;  ///< from then on other threads read info_
  Access device_access_;
  Access sensor_access_;
  Access instrument_access_;
  Vector3 outside_mm_;  ///< written and read by the clock's thread
  bool has_outside_ = false;
  std::uint64_t ticks_ = 0;
  Clock::time_point started_{};
  std::uint32_t bias_serial_ = 0;  ///< of the sensor, last reported
  RigSample last_;                 ///< an absent device keeps this pose
};

}  // namespace hapticd::hal
