#include "server/pose/contact_follower.h"

namespace hapticd::pose {

void ContactFollower::follow(const rt::TickRecord& record, const TipMotion& path) noexcept {
  const bool follows = last_ns_ && record.time_ns - *last_ns_ <= kMaxGapNs && record.time_ns >= *last_ns_;
  last_ns_ = record.time_ns;
  const bool knows = (record.channels & rt::channel::kContact) != 0;
  if (record.scene_generation != scene_) {
    // Another scene counts from 1 again.
    event_.reset();
    in_contact_ = false;
    withdrawn_ = record.withdrawn_count;
    scene_ = record.scene_generation;
  }
  if (!knows) {
    // A sample that is not fit for use: nothing is known of a contact that there was.
    if (follows && in_contact_ && event_ && !event_->ended_ns) event_->ended_ns = record.time_ns;
    in_contact_ = false;
    return;
  }
  const bool is_new =
      record.in_contact && (!in_contact_ || !event_ || event_->number != record.contact_count);
  if (is_new) {
    ContactEvent begun;
    begun.number = record.contact_count;
    begun.began = record.contact_onset;
    if (follows) begun.declared_ns = record.time_ns;
    if (const auto tip_mm = path.position_mm(record.contact_onset.time_ns)) {
      begun.tip_mm = *tip_mm;
      begun.tip_known = true;
    }
    event_ = begun;
  } else if (in_contact_ && !record.in_contact && event_ && !event_->ended_ns) {
    if (follows) event_->ended_ns = record.time_ns;
    event_->withdrawn = record.withdrawn_count != withdrawn_;
  }
  in_contact_ = record.in_contact;
  withdrawn_ = record.withdrawn_count;
}

}  // namespace hapticd::pose
