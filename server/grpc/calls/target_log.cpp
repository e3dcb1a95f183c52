#include "server/grpc/calls/target_log.h"

namespace hapticd::server {

std::string TargetLog::line(const std::string& target, const std::string& peer, Clock::time_point now) {
  const MutexLock lock(mutex_);
  if (peer == last_peer_ && now < next_) {
    ++unwritten_;
    return {};
  }
  std::string text = "target " + target + " set by " + peer;
  if (unwritten_ > 0) text += " (" + std::to_string(unwritten_) + " more since the last such line)";
  last_peer_ = peer;
  next_ = now + std::chrono::seconds(1);
  unwritten_ = 0;
  return text;
}

}  // namespace hapticd::server
