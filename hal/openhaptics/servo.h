#pragma once

#include <pthread.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>

#include "hal/openhaptics/device_error_slot.h"
#include "hal/openhaptics/device_frame.h"
#include "hal/openhaptics/hd_library.h"
#include "hal/rig.h"

namespace hapticd::openhaptics {

/// Settings of a servo.
struct ServoSetup {
  double rate_hz = 1000.0;
  double force_limit_n = 0.0;
  double warm_share = 0.9;
  std::int64_t stall_ns = 0;
  hal::Vector3 origin_mm;  ///< device frame
  hal::Vector3 tip_offset_mm;
  hal::Quaternion tool_to_stylus;
  int motors = 3;
  bool calibrated = false;
  int calibration_style = 0;  ///< requested while the servo runs; 0 = none
};

/// What a servo shows any thread. Outlives it, so that it can be read after the device was closed.
struct ServoReport {
  static constexpr std::size_t kMaxMotors = 32;  ///< more than any device has
  ServoReport() {
    for (auto& share : temperatures) share.store(-1.0, std::memory_order_relaxed);
  }

  std::atomic<std::uint64_t> frames{0};
  std::atomic<std::uint64_t> stalls{0};
  std::atomic<std::int64_t> longest_gap_ns{0};
  std::atomic<std::int64_t> last_stall_ns{0};      ///< steady clock; 0 = never
  std::atomic<std::int64_t> last_rejection_ns{0};  ///< of a position; steady clock; 0 = never
  std::atomic<std::uint64_t> commands_limited{0};
  std::atomic<std::uint64_t> commands_not_finite{0};
  std::atomic<std::uint64_t> positions_rejected{0};
  std::atomic<std::uint64_t> orientations_rejected{0};
  std::atomic<std::uint64_t> error_stacks_overfull{0};
  std::atomic<std::uint32_t> status{0};  ///< of the last sample
  std::atomic<bool> calibrated{false};
  std::atomic<bool> wants_calibration_update{false};
  std::atomic<bool> force_off{false};  ///< the library says that the output is off while it should be on
  int motors = 0;
  /// Motor temperatures, 0 … 1 of the rated one; negative: unknown.
  std::array<std::atomic<double>, kMaxMotors> temperatures;
};

/// One device in the vendor's scheduler: everything that happens in its callback. Only the vendor's own
/// functions may lock, allocate or wait in there.
class Servo {
 public:
  Servo(std::shared_ptr<HdLibrary> library, hd::Handle device, std::shared_ptr<DeviceErrorSlot> slot,
        const ServoSetup& setup);

  // -- the thread that runs the clock, while no callback is scheduled
  /// Arms the servo for a new run.
  void arm(hal::ServoBody& body) noexcept;
  static hd::CallbackCode callback(void* servo) noexcept { return static_cast<Servo*>(servo)->turn(); }
  hd::Handle device() const noexcept { return device_; }

  // -- the thread that runs the clock, while a callback is scheduled
  /// Finishes: the next turn writes zero force in a separate frame, switches the force off and is the last
  /// one.
  void finish() noexcept { finishing_.store(true, std::memory_order_release); }
  bool finished() const noexcept { return finished_.load(std::memory_order_acquire); }
  enum class Leaving {
    kClean,  ///< no turn is in progress and none will act any more
    kStuck,  ///< a turn is inside the vendor's library and will not act if it ever returns
  };
  /// Stops the callback from acting from now on; waits for a turn in progress.
  Leaving give_up(std::chrono::milliseconds timeout) noexcept;

  // -- inside the callback (from on_servo), or when no run is under way
  void read(hal::RigSample& sample) const noexcept;
  void write(const hal::DeviceCommand& command) noexcept;

  // -- any thread, in a signal handler
  /// Makes every turn from now on one without force. Waits until a turn without force has ended, for
  /// kCrashTimeoutMs at most. If the crash is in our own part of a turn, ends that turn without force. For a
  /// crash in the vendor's library nothing can be done.
  void write_zero_in_crash() noexcept;

  // -- any thread
  const std::shared_ptr<ServoReport>& report() const noexcept { return reported_; }

 private:
  using Nanoseconds = std::int64_t;
  static constexpr int kCrashTimeoutMs = 50;
  enum State : int { kIdle, kInFrame, kInBody, kOver };

  hd::CallbackCode turn() noexcept;
  bool move(int from, int to) noexcept;
  void last_frame() noexcept;
  void begin() noexcept;
  void render(const hal::Vector3& force_n) noexcept;
  void end() noexcept;
  void mark_time() noexcept;
  void calibrate() noexcept;
  void measure() noexcept;
  void take_pose() noexcept;
  void take_angles() noexcept;
  void feel_motors() noexcept;
  void check_output() noexcept;
  bool knows_what_was_asked() noexcept;
  void drain() noexcept;

  const std::shared_ptr<HdLibrary> library_;
  const hd::Api& api_;
  const hd::Handle device_;
  const std::shared_ptr<DeviceErrorSlot> slot_;
  const ServoSetup setup_;
  const std::uint64_t slow_every_;  ///< turns between two updates of a calibration

  // Shared between the callback and the thread that runs the clock.
  std::atomic<int> state_{kOver};
  std::atomic<bool> finishing_{false};
  std::atomic<bool> finished_{false};
  std::atomic<bool> crashed_{false};
  std::atomic<pthread_t> turner_{};  ///< the scheduler's thread, once a turn has begun
  hal::ServoBody* body_ = nullptr;

  // Used by the callback only.
  hal::Vector3 tip_mm_;
  hal::Quaternion orientation_;
  hal::DeviceAngles angles_;
  std::uint32_t status_ = 0;
  bool pose_fault_ = false;
  bool limited_ = false;
  bool temperature_known_ = true;  ///< false once the library reports that the device has none
  bool output_known_ = true;
  bool angles_known_ = true;
  hal::Vector3 command_n_;
  std::uint64_t turns_ = 0;
  Nanoseconds now_ns_ = 0;
  Nanoseconds frame_ns_ = 0;  ///< start of the present frame, when the library reads the device
  Nanoseconds tip_ns_ = 0;    ///< of tip_mm_
  Nanoseconds last_turn_ns_ = 0;
  Nanoseconds fault_until_ns_ = 0;

  const std::shared_ptr<ServoReport> reported_ = std::make_shared<ServoReport>();
};

}  // namespace hapticd::openhaptics
