#include "rt/assist/assistance.h"

#include <algorithm>

namespace hapticd::rt {

void Assistance::exchange(const AssistanceSpec& spec, bool fades) noexcept {
  leaving_n_ = fixture_force_n_;
  leaving_share_ = fades && dot(leaving_n_, leaving_n_) > 0.0 ? 1.0 : 0.0;
  fixture_force_n_ = {};
  fixture_.reset();
  watch_.reset();
  if (spec.fixture) fixture_.emplace(*spec.fixture, spec.press_axis);
  if (spec.watch) watch_.emplace(*spec.watch, spec.press_axis, rate_hz_);
}

std::uint32_t Assistance::begin_guide(const GuideMotion& motion) noexcept {
  guide_.begin(motion);
  if (fixture_) fixture_->forget();
  return guide_.number();
}

std::uint32_t Assistance::begin_presentation() noexcept {
  if (!watch_) return 0;
  watch_->begin(++presentations_);
  return presentations_;
}

PresentationSummary Assistance::end_presentation() noexcept {
  return watch_ && watch_->is_running() ? watch_->end() : PresentationSummary{};
}

hal::Vector3 Assistance::update(const hal::RigSample& sample, const Touch& touch, bool is_force_allowed,
                                double interval_s) noexcept {
  const bool is_known = hal::finite(sample.tip_position_mm);
  if (is_known) {
    speed_.update(sample.tip_position_mm, interval_s);
  } else {
    speed_.reset();
  }
  is_touched_ = touch.in_contact && (is_touched_ || touch.is_evident);
  const bool allowed = is_force_allowed && is_known;
  const hal::Vector3& velocity = speed_.velocity_mm_per_s();
  guide_force_n_ = guide_.update({sample.tip_position_mm, velocity, interval_s, is_touched_, allowed});
  leaving_share_ = allowed ? std::max(0.0, leaving_share_ - interval_s / kLeaveS) : 0.0;
  fixture_force_n_ = leaving_n_ * leaving_share_;
  if (fixture_) {
    fixture_force_n_ =
        fixture_force_n_ +
        fixture_->update({sample.tip_position_mm, velocity, interval_s, is_touched_, touch.is_withdrawn,
                          touch.displacement_mm, guide_.is_acting(), allowed});
  }
  return force_n();
}

void Assistance::fill_record(TickRecord& record) const noexcept {
  record.channels |= channel::kAssist;
  record.guide_force_n = guide_force_n_;
  record.guide_number = guide_.number();
  record.guide_state = guide_.state();
  record.fixture_force_n = fixture_force_n_;
  if (!watch_) return;
  record.presentation = watch_->is_running() ? watch_->summary().number : 0;
  record.presentation_broken = watch_->summary().broken;
}

}  // namespace hapticd::rt
