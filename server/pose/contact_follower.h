#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "rt/record/tick_record.h"
#include "server/pose/tip_motion.h"

namespace hapticd::pose {

/// A contact, as a client gets it with every pose until the next one begins.
struct ContactEvent {
  std::uint32_t number = 0;  ///< counts the contacts of the loaded scene from 1
  rt::OnsetInstant began;
  std::optional<std::int64_t> declared_ns;           ///< none: that was while nothing was followed
  Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();  ///< where it began, as encoders have it, rig frame
  bool tip_known = false;                            ///< false: it was followed only after it had begun
  std::optional<std::int64_t> ended_ns;              ///< none: it lasts, or its end was not followed
  bool withdrawn = false;                            ///< it turned out to be no object
};

/// Makes events of what the records say about contact. Records that are missing between two subscriptions
/// leave the instants unknown that were in between.
class ContactFollower {
 public:
  /// Records further apart are not followed.
  static constexpr std::int64_t kMaxGapNs = 50'000'000;
  /// `path`: of the tip, this record's included.
  void follow(const rt::TickRecord& record, const TipMotion& path) noexcept;
  void forget() noexcept { event_.reset(); }
  /// The present contact, or else the last; none before the first.
  const std::optional<ContactEvent>& event() const noexcept { return event_; }

 private:
  std::optional<ContactEvent> event_;
  std::optional<std::int64_t> last_ns_;  ///< of the last record
  bool in_contact_ = false;
  std::uint32_t scene_ = 0;
  std::uint32_t withdrawn_ = 0;
};

}  // namespace hapticd::pose
