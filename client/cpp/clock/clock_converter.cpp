#include "client/cpp/clock/clock_converter.h"

#include <algorithm>
#include <cmath>

namespace hapticd::client {

double ClockConverter::Piece::beyond_ns(std::int64_t client_ns) const {
  const auto age_ns = static_cast<double>(client_ns - begin_ns);
  const double slewed = std::max(0.0, std::abs(left_ns) - 1e-6 * kSlewPpm * std::max(0.0, age_ns));
  return drift * age_ns + std::copysign(slewed, left_ns);
}

const ClockConverter::Piece& ClockConverter::piece_at(std::int64_t client_ns) const {
  const auto later = std::find_if(pieces_.rbegin(), pieces_.rend(),
                                  [&](const Piece& piece) { return piece.begin_ns <= client_ns; });
  return later == pieces_.rend() ? pieces_.front() : *later;
}

void ClockConverter::follow(const ClockBounds& now, double drift_ppm) {
  Piece next;
  next.begin_ns = now.client_ns;
  next.drift = 1e-6 * drift_ppm;
  next.offset_ns = now.offset_ns();
  if (!pieces_.empty()) {
    // What was answered already stays.
    next.begin_ns = std::max(next.begin_ns, pieces_.back().begin_ns);
    if (was_asked_) next.begin_ns = std::max(next.begin_ns, last_asked_ns_);
    const auto ahead_ns = static_cast<double>(next.begin_ns - now.client_ns);
    next.offset_ns += static_cast<std::int64_t>(std::llround(next.drift * ahead_ns));
    const Piece& before = pieces_.back();
    next.left_ns = static_cast<double>(before.offset_ns - next.offset_ns) + before.beyond_ns(next.begin_ns);
  }
  pieces_.push_back(next);
  if (pieces_.size() > kPieces) pieces_.pop_front();
}

std::int64_t ClockConverter::to_daemon_ns(std::int64_t client_ns) {
  const Piece& piece = piece_at(client_ns);
  std::int64_t daemon_ns =
      client_ns + piece.offset_ns + static_cast<std::int64_t>(std::floor(piece.beyond_ns(client_ns)));
  if (was_asked_ && client_ns < last_asked_ns_) return std::min(daemon_ns, last_answered_ns_);
  if (was_asked_) daemon_ns = std::max(daemon_ns, last_answered_ns_);
  was_asked_ = true;
  last_asked_ns_ = client_ns;
  last_answered_ns_ = daemon_ns;
  return daemon_ns;
}

}  // namespace hapticd::client
