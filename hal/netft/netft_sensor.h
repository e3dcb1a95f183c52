#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "hal/axis_map.h"
#include "hal/force_mean.h"
#include "hal/latest_value.h"
#include "hal/lock/mutex.h"
#include "hal/netft/netft_config.h"
#include "hal/netft/netft_configuration.h"
#include "hal/netft/rdt_stream.h"
#include "hal/rig.h"

namespace hapticd::netft {

/// A Nano17 behind a Net F/T box.
///
/// engage(), disengage(), bias() and the like serialise among themselves; read() shares no lock with them and
/// is wait-free. A box that restarts goes on being read, but its configuration is checked again: it has
/// forgotten a bias set on it, and may be configured differently. A lost bias is reported and every sample
/// carries a warning; it is not set again by itself, since the driver cannot know whether the tool is free,
/// and a bias taken under load would hide that load from then on. The box takes a bias from anyone: its page
/// is read again every kPageInterval and after every silence, and a bias that another program has set counts
/// as lost, and is reported so. A bias outlasts disengage() and engage(), as long as the box counts as before
/// and has no other bias. Every bias, and every loss of one, changes hal::RigSample::bias_serial.
class NetFtSensor final : public hal::ForceSensor {
 public:
  /// Checks the configuration; opens nothing.
  static hal::Result<std::unique_ptr<NetFtSensor>> create(const NetFtConfig& config);
  ~NetFtSensor() override;
  NetFtSensor(const NetFtSensor&) = delete;
  NetFtSensor& operator=(const NetFtSensor&) = delete;

  std::optional<hal::Error> engage() override;
  void disengage() noexcept override;
  hal::PartReport report() const override;
  /// Properties by the configuration only.
  const hal::SensorInfo& info() const noexcept override { return info_; }
  void read(hal::RigSample& sample) noexcept override;
  /// Takes the mean of 0.25 s as zero, or commands the box to do so and checks the result. Waits for at
  /// most 3 s.
  std::optional<hal::Error> bias() override;

  static constexpr std::chrono::seconds kPageInterval{3};

 private:
  NetFtSensor(const NetFtConfig& config, const hal::AxisMap& axes);

  std::optional<hal::Error> connect(std::chrono::steady_clock::time_point deadline) REQUIRES(control_);
  hal::Result<BoxConfiguration> read_box(std::chrono::steady_clock::time_point deadline) const;
  std::optional<hal::Error> await_sample(std::chrono::steady_clock::time_point deadline);
  std::optional<hal::Error> bias_in_software() REQUIRES(control_);
  std::optional<hal::Error> bias_on_box() REQUIRES(control_);
  void keep_zero(const SixAxes<double>& bias_counts) REQUIRES(control_);
  /// True if an earlier bias is still valid for the present box. If not, a bias without meaning is dropped,
  /// and the serial number changes.
  bool zero_holds(const std::optional<BoxConfiguration>& box) REQUIRES(control_);
  /// Mean counts of good samples over at least kBiasTime.
  hal::Result<SixAxes<double>> measure_mean();
  /// Reads the page of a box that restarted, and now and then, until it is stopped.
  void watch_page(const std::stop_token& stop);
  void check_restarted_box(const std::stop_token& stop);
  /// Looks whether another program has biased the box since.
  void look_for_foreign_bias(const std::stop_token& stop);
  hal::Error not_engaged(const char* what) const;
  std::string place() const;
  /// Rate by the box's page, Hz; 0 if unknown.
  double box_rate_hz() const;

  const NetFtConfig config_;
  const hal::AxisMap axes_;
  const hal::SensorInfo info_;
  const std::int64_t stale_after_ns_;

  // Used by the tick.
  hal::LatestValue<RdtTotals> latest_;
  RdtTotals seen_;
  std::int64_t last_read_ns_ = 0;
  hal::ForceMean mean_;
  std::atomic<bool> engaged_{false};
  std::atomic<bool> bias_lost_{false};
  std::atomic<bool> biased_by_other_{false};     ///< why it is lost
  std::atomic<std::uint32_t> bias_commands_{0};  ///< begun and ended: odd while one is under way
  std::atomic<bool> configuration_changed_{false};
  std::atomic<std::uint32_t> bias_serial_{0};  ///< of the zero; see hal::RigSample
  std::atomic<std::uint64_t> skipped_{0};      ///< samples too old to be part of a mean

  mutable SerialMutex control_;  ///< serialises engage, disengage and bias
  RdtCounters counters_;
  RdtStream stream_{latest_, counters_};
  std::string numeric_address_;
  double newtons_per_count_ = 0.0;
  double newton_millimetres_per_count_ = 0.0;
  /// Result of a bias; survives disengage(). Counts are a load only together with their units.
  struct Zero {
    SixAxes<double> bias_counts{};
    double newtons_per_count = 0.0;
    double newton_millimetres_per_count = 0.0;
  };
  std::optional<Zero> zero_ GUARDED_BY(control_);

  mutable Mutex reported_;
  std::optional<BoxConfiguration> box_ GUARDED_BY(reported_);
  std::string connection_ GUARDED_BY(reported_);
  std::string refusal_ GUARDED_BY(reported_);  ///< why engage() failed last
  std::string change_ GUARDED_BY(reported_);   ///< how a restarted box differs
  std::string shortcoming_ GUARDED_BY(reported_);
  /// The box's gage offsets at its last bias or engagement; empty = unknown.
  std::optional<std::array<double, 6>> box_bias_ GUARDED_BY(reported_);
  std::optional<std::array<double, 6>> foreign_bias_ GUARDED_BY(reported_);  ///< that was reported last

  Mutex restart_mutex_;
  Condition restarted_;
  bool restart_seen_ GUARDED_BY(restart_mutex_) = false;
  std::jthread checker_;  ///< see watch_page()
};

}  // namespace hapticd::netft
