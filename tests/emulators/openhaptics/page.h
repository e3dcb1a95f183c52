#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/samples.h"
#include "tests/support/system/shared_page.h"

namespace hapticd::emulators {

/// What a stand-in for the vendor's library and the world outside it have in common: one file, mapped by
/// both, named to the library in the environment variable HD_STAND_IN_PAGE. All frames are the vendor's: x to
/// the right, y up, z towards the user.

/// One of its devices. "In" is written by the world, "out" by the library.
struct HdPageDevice {
  // -- in: the device as it is; the name may not change while the library is loaded
  char name[32];                             ///< for hdInitDevice; the first device is also the default one
  char model_type[32];                       ///< what HD_DEVICE_MODEL_TYPE says
  std::atomic<std::uint32_t> pose_sequence;  ///< odd while the transform is being written
  std::atomic<double> transform[16];         ///< column by column, mm
  std::atomic<double> angles_rad[6];         ///< joints, then gimbal
  std::atomic<bool> has_angles;              ///< otherwise they are invalid parameters
  std::atomic<double> motor_temperature[3];  ///< 0 … 1
  std::atomic<double> max_force_n;
  std::atomic<double> max_continuous_force_n;
  std::atomic<double> max_stiffness_n_per_mm;
  std::atomic<std::uint32_t> calibration_state;           ///< as hdCheckCalibration returns it
  std::atomic<std::int32_t> calibration_styles;           ///< bits
  std::atomic<std::uint32_t> calibration_updates_needed;  ///< so many updates make a calibration; 0 = never

  // -- in: what is wrong with it
  std::atomic<std::uint32_t>
      init_error;  ///< hdInitDevice pushes this and fails, unless it is one of force (0x02..)
  std::atomic<bool> init_fails_silently;   ///< returns the invalid handle and no error
  std::atomic<std::uint32_t> frame_error;  ///< pushed by each of the next `frame_error_frames` frames …
  std::atomic<std::uint32_t> frame_error_frames;
  std::atomic<std::uint32_t> frame_error_burst;  ///< … so many times each; 0 counts as 1
  std::atomic<bool> unplugged;                   ///< every frame ends in a communication error
  std::atomic<bool> position_is_nan;
  std::atomic<bool> transform_is_nan;
  std::atomic<bool> transform_is_mirrored;
  std::atomic<bool> refuses_force;      ///< force output cannot be enabled
  std::atomic<bool> lacks_temperature;  ///< HD_MOTOR_TEMPERATURE is an invalid parameter

  // -- out
  std::atomic<bool> open;
  std::atomic<bool> force_enabled;
  std::atomic<std::uint32_t> force_sequence;  ///< odd while the force is being written
  std::atomic<double> force_n[3];             ///< of the last completed frame; zero while output is disabled
  std::atomic<std::int64_t> force_time_ns;    ///< of that frame, CLOCK_MONOTONIC
  std::atomic<std::uint64_t> frames;          ///< completed
  std::atomic<std::uint32_t> calibration_updates;
  std::atomic<std::uint64_t> frames_forced;  ///< completed with a force other than zero
};

/// What happened, in the order in which it did.
enum class HdEvent : std::uint32_t {
  kNone,
  kLoaded,
  kInit,
  kForceOn,
  kRate,
  kSchedule,
  kStart,
  kZeroFrame,   ///< the first completed frame without force after one with force
  kForceFrame,  ///< the first completed frame with force after one without
  kForceOff,
  kUnschedule,
  kStop,
  kDisable,
  kUnloaded,
};

struct HdPageLayout {
  static constexpr std::uint32_t kMagic = 0x48445031;
  static constexpr std::size_t kDevices = 2;
  static constexpr std::size_t kEvents = 256;
  static constexpr std::size_t kLateTicks = 65536;

  std::uint32_t magic;
  HdPageDevice devices[kDevices];

  // -- in: what is wrong with the library
  std::atomic<bool> kill_scheduler;           ///< its thread ends for good
  std::atomic<std::uint32_t> stall_ms;        ///< it sleeps for so long, once; set to 0 when it begins to
  std::atomic<std::uint32_t> frame_hangs_ms;  ///< hdBeginFrame does, once
  std::atomic<double> slow_hz;                ///< > 0: its rate, whatever it was set to
  std::atomic<std::uint32_t> init_hangs_ms;   ///< hdInitDevice takes so long
  std::atomic<std::uint32_t> stop_hangs_ms;   ///< hdStopScheduler takes so long
  std::atomic<std::uint32_t> rate_error;      ///< hdSetSchedulerRate pushes this
  std::atomic<std::uint32_t> schedule_error;  ///< hdScheduleAsynchronous pushes this and schedules nothing

  std::atomic<std::uint32_t> late_ticks;   ///< so many of `late_us` are used, over and over; 0 = even ticks
  std::atomic<float> late_us[kLateTicks];  ///< tick by tick, by how much later than even its scheduler calls

  // -- out
  std::atomic<bool> loaded;
  std::atomic<bool> scheduler_running;
  std::atomic<std::uint64_t> scheduler_rate_hz;
  std::atomic<std::uint64_t> ticks;
  std::atomic<std::uint64_t> violations;      ///< of the order in which its functions may be called
  std::atomic<std::uint32_t> last_violation;  ///< 1 frame begun twice, 2 ended unbegun, 3 force set outside a
                                              ///< frame, 4 bad handle, 5 frames while unscheduled, 6 unloaded
                                              ///< with a device open, 7 unloaded while the scheduler ran,
                                              ///< 8 device disabled with its force on
  std::atomic<std::uint32_t> event_count;
  std::atomic<std::uint32_t> events[kEvents];
};
static_assert(std::atomic<double>::is_always_lock_free && std::atomic<std::uint64_t>::is_always_lock_free);

/// The world's end of a page. Many threads may set faults; one feeds poses.
class HdPage : public test::SharedPage<HdPageLayout> {
 public:
  /// Makes it, with sound devices at rest: "Default Device" and "Second Device".
  explicit HdPage(const std::string& path);
  using SharedPage::SharedPage;

  HdPageDevice& device(std::size_t index = 0) noexcept { return layout().devices[index]; }

  /// Rotation and position at once: what a frame reads is one pose, never half of two. Vendor's frame.
  void set_pose(const hal::Vector3& position_mm, const hal::Quaternion& orientation,
                std::size_t index = 0) noexcept;
  void set_angles(const std::array<double, 3>& joint_rad, const std::array<double, 3>& gimbal_rad,
                  std::size_t index = 0) noexcept;
  void set_transform(const std::array<double, 16>& transform, std::size_t index = 0) noexcept;
  /// What the motors give now: nothing with the output disabled, the device closed or when the last frame is
  /// older than the device's own watchdog allows. Vendor's frame.
  hal::Vector3 force_n(std::size_t index = 0) const noexcept;
  /// The library's scheduler is late by these, one after the other and over and over; at most kLateTicks are
  /// used. Empty: it is not.
  void set_late_ticks(const std::vector<double>& late_us) noexcept;
  std::vector<HdEvent> events() const;
  void forget_events() noexcept { layout().event_count = 0; }

  /// Watchdog of the device: without a frame for so long its motors go off.
  static constexpr std::int64_t kWatchdogNs = 200'000'000;
};

}  // namespace hapticd::emulators
