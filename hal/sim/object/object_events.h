#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "hal/error.h"
#include "hal/samples.h"

namespace hapticd::sim {

/// Something that happens to the object in place. Rig frame.
struct ObjectEvent {
  enum class Kind : std::uint8_t {
    kVanish,  ///< it is gone at once
    kReturn,  ///< a vanished object is there again, as soon as the tip is clear of where it will be
    kMove,    ///< by `move_mm`, evenly over `duration_s` (0 = at once)
    kTilt,    ///< by `tilt_deg` about the y axis through its origin, evenly over `duration_s`
  };
  Kind kind = Kind::kVanish;
  double at_s = 0.0;  ///< the rig's time; what lies behind it happens at once
  hal::Vector3 move_mm{};
  double tilt_deg = 0.0;
  double duration_s = 0.0;
};

/// Checks an event; nothing if it can happen.
std::optional<hal::Error> check(const ObjectEvent& event);

/// How an object is held on the table, and where it ends.
struct ObjectHold {
  /// Edge of the object: it ends at a plane x = edge_mm of the object's frame; what lies beyond is air. None:
  /// it goes on for ever.
  std::optional<double> edge_mm{};
  double edge_round_mm = 1.5;  ///< over which its stiffness falls to nothing at the edge
  /// Friction on the table: pushed along it by more, it slides. 0 = held fast.
  double slides_above_n = 0.0;
};

std::optional<hal::Error> check(const ObjectHold& hold);

/// Events on their way to the clock's thread. One thread at a time adds, the clock's takes. Wait-free.
class ObjectEventQueue {
 public:
  bool push(const ObjectEvent& event) noexcept;  ///< false if it is full
  bool pop(ObjectEvent& event) noexcept;

 private:
  static constexpr std::size_t kCapacity = 32;
  std::array<ObjectEvent, kCapacity> events_{};
  std::atomic<std::size_t> pushed_{0};
  std::atomic<std::size_t> popped_{0};
};

/// Place of an object, and whether it is still there. Moved along by the simulation step by step.
class ObjectPose {
 public:
  ObjectPose() = default;
  ObjectPose(const ObjectHold& hold, double step_s) noexcept : hold_(hold), step_s_(step_s) {}

  /// False if nothing ever moved it and it has no edge: then the object's frame is the rig's.
  bool displaced() const noexcept { return displaced_ || hold_.edge_mm || hold_.slides_above_n > 0.0; }
  bool present() const noexcept { return present_; }
  void set_present(bool present) noexcept {
    present_ = present;
    displaced_ = true;
  }
  void begin(const ObjectEvent& event) noexcept;
  /// Advances by one step. `pushed_n`: force of the tip on the object along the table.
  void advance(const hal::Vector3& pushed_n) noexcept;

  hal::Vector3 to_object(const hal::Vector3& rig_mm) const noexcept;
  hal::Vector3 to_rig(const hal::Vector3& object_mm) const noexcept;
  hal::Vector3 direction_to_rig(const hal::Vector3& in_object) const noexcept;
  /// Motion of the place `rig_mm`, over the last step.
  hal::Vector3 moved_mm(const hal::Vector3& rig_mm) const noexcept;
  /// Share of the object's matter that is there under a point of the object's frame: 1, 0 beyond the edge.
  double share_at(const hal::Vector3& object_mm) const noexcept;
  const hal::Vector3& offset_mm() const noexcept { return offset_mm_; }

 private:
  ObjectHold hold_;
  double step_s_ = 1e-4;
  bool displaced_ = false;
  bool present_ = true;
  hal::Vector3 offset_mm_;
  double tilt_rad_ = 0.0;
  hal::Vector3 moved_last_mm_;
  double turned_last_rad_ = 0.0;
  hal::Vector3 move_rate_mm_per_s_;
  double move_left_s_ = 0.0;
  double tilt_rate_rad_per_s_ = 0.0;
  double tilt_left_s_ = 0.0;
};

/// The events of a run, in their order; bounded.
class ObjectSchedule {
 public:
  bool add(const ObjectEvent& event) noexcept;  ///< false if it is full
  /// Takes the next event that is due by now; false when there is none.
  bool due(double time_s, ObjectEvent& event) noexcept;
  bool empty() const noexcept { return count_ == 0; }

 private:
  static constexpr std::size_t kCapacity = 64;
  std::array<ObjectEvent, kCapacity> events_{};  ///< by time, the last first
  std::size_t count_ = 0;
};

}  // namespace hapticd::sim
