#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "hal/daq/board.h"
#include "hal/samples.h"
#include "tests/emulators/board/arm_emulator.h"
#include "tests/emulators/board/gauge_emulator.h"

namespace hapticd::emulators {

struct ScriptedBoardConfig {
  /// True: scans come by the board's clock, each of the load fed last. False: each feed() is one scan.
  bool paced = true;
  double scan_rate_hz = 10000.0;
  int input_bits = 16;
  int output_bits = 16;
  int counter_bits = 24;
  std::array<double, 6> gauge_offset_v{0.4, -0.3, 0.2, -0.1, 0.35, -0.25};  ///< with nothing on the sensor
  double gauge_noise_v = 0.0;                                               ///< uniform, ± this
  std::array<std::int64_t, 6> counter_start{12345, -54321, 99, 7, -7, 70};  ///< counts at power-on
  ArmDescription arm{};
  std::array<double, 3> gimbal_counts_per_turn{4096.0, 4096.0, 4096.0};
};

/// A board with a sensor, an arm and a gimbal wired to it, none of them real. Feed it a load and a tip
/// position; take from it the force the motors make at the tip. Any thread may call anything.
///
/// Time is the steady clock's, or, after freeze_time(), what advance() makes of it.
class ScriptedBoard final : public daq::Board {
 public:
  explicit ScriptedBoard(const ScriptedBoardConfig& config = {});

  // The world's side.
  void feed(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm);
  void move_tip(const hal::Vector3& position_mm);
  void move_joints(const std::array<double, 3>& joints_rad);
  void turn_gimbal(const std::array<double, 3>& angles_rad);
  /// The orientation of the tool, by the gimbal; where the joints are meanwhile.
  void orient(const hal::Quaternion& orientation);
  /// Volts at the inputs after the gauges'.
  void put_spare(const std::array<double, daq::kSpareInputs>& volts);
  hal::Vector3 tip_force_n() const;
  std::array<double, 3> output_volts() const;
  std::uint64_t output_writes() const;
  const GaugeEmulator& gauges() const { return gauges_; }
  const ArmEmulator& arm() const { return arm_; }

  void freeze_time();
  void advance_ns(std::int64_t by_ns);
  /// Done by whichever call comes first after that time.
  void at_ns(std::int64_t time_ns, std::function<void(ScriptedBoard&)> action);

  // Faults.
  void lose_scans(std::size_t scans);  ///< an overrun of the board's buffer
  void stop_scans(bool stopped = true) {
    put_after_scans(stopped_, stopped);
  }  ///< the acquisition is at rest, and says so
  void mute_scans(bool muted = true) {
    put_after_scans(muted_, muted);
  }                                                ///< no scans any more, though it claims to run
  void put_nan(bool on = true) { put(nan_, on); }  ///< on all gauges
  void put_rail(std::size_t gauge, double volts) {
    put(rail_v_[gauge], volts);
  }  ///< a gauge stuck at a voltage
  void repair_gauges();
  void freeze_encoder(std::size_t joint, bool frozen = true);
  void jump_encoder(std::size_t joint, std::int64_t counts) {
    const std::lock_guard lock(mutex_);
    shift_[joint] += counts;
  }
  void fail_counters(bool failing = true) { put(counters_fail_, failing); }
  void fail_outputs(bool failing = true) { put(outputs_fail_, failing); }
  void vanish(bool gone = true) { put_after_scans(gone_, gone); }  ///< all of it, engage() included

  bool engaged(daq::BoardUse use) const;

  daq::BoardInfo info() const override;
  std::int64_t now_ns() const noexcept override;
  void describe(hal::PartReport& report) const override;

 protected:
  std::optional<hal::Error> open(daq::BoardUse use) override;
  void close(daq::BoardUse use) noexcept override;
  daq::ScanReading take_scans(std::span<daq::Scan> scans) noexcept override;
  bool read_raw_counters(std::span<std::uint64_t> raw) noexcept override;
  bool put_volts(std::span<const double> volts) noexcept override;

 private:
  template <class T, class Value>
  void put(T& member, Value value) {
    const std::lock_guard lock(mutex_);
    member = value;
  }
  /// Performs first what was due until now.
  void put_after_scans(bool& member, bool value) {
    const std::lock_guard lock(mutex_);
    if (config_.paced) make_due_scans();
    member = value;
  }
  daq::Scan scan_at(std::int64_t time_ns);
  void make_due_scans();
  void perform_due();
  std::int64_t clock_ns() const;

  const ScriptedBoardConfig config_;
  const GaugeEmulator gauges_;
  const ArmEmulator arm_;

  std::atomic<bool> frozen_time_{false};
  std::atomic<std::int64_t> time_ns_{0};

  mutable std::recursive_mutex mutex_;
  std::array<bool, 2> open_{};
  std::multimap<std::int64_t, std::function<void(ScriptedBoard&)>> script_;

  hal::Vector3 force_n_;
  hal::Vector3 torque_n_mm_;
  std::deque<daq::Scan> scans_;
  std::int64_t next_scan_ns_ = 0;
  std::int64_t newest_ns_ = 0;
  std::uint64_t noise_ = 88172645463325252ULL;
  bool overrun_ = false;
  bool stopped_ = false;
  bool muted_ = false;
  bool nan_ = false;
  std::array<std::optional<double>, 6> rail_v_{};
  std::array<double, daq::kSpareInputs> spare_v_{};

  std::array<double, 3> joints_rad_{};
  std::array<double, 3> gimbal_rad_{};
  std::array<std::int64_t, 6> shift_{};
  std::array<std::optional<std::int64_t>, 6> frozen_{};
  std::array<double, 3> output_v_{};
  std::uint64_t output_writes_ = 0;
  bool counters_fail_ = false;
  bool outputs_fail_ = false;
  bool gone_ = false;
};

}  // namespace hapticd::emulators
