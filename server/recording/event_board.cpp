#include "server/recording/event_board.h"

#include <utility>

namespace hapticd::server {

void EventBoard::add(recording::Event event) {
  const std::lock_guard lock(mutex_);
  events_.push_back(std::move(event));
  ++last_;
  if (events_.size() > kKept) events_.pop_front();
}

std::vector<recording::Event> EventBoard::after(std::uint64_t& number, std::uint64_t& missed) const {
  const std::lock_guard lock(mutex_);
  const std::uint64_t before_first = last_ - events_.size();
  if (number < before_first) {
    missed += before_first - number;
    number = before_first;
  }
  std::vector<recording::Event> found(events_.begin() + static_cast<std::ptrdiff_t>(number - before_first),
                                      events_.end());
  number = last_;
  return found;
}

std::uint64_t EventBoard::last() const {
  const std::lock_guard lock(mutex_);
  return last_;
}

}  // namespace hapticd::server
