#include "server/recording/event_log.h"

#include <algorithm>
#include <iterator>

namespace hapticd::server {

namespace {

bool is_frequent(recording::EventKind kind) {
  return kind == recording::EventKind::kTarget || kind == recording::EventKind::kOverrun;
}

}  // namespace

void EventLog::add(recording::Event event, bool is_in_records) {
  {
    const MutexLock lock(mutex_);
    const bool frequent = is_frequent(event.kind);
    auto& events = events_[frequent ? 0 : 1];
    events.push_back({++last_, std::move(event), is_in_records});
    if (events.size() > (frequent ? kKeptOfFrequent : kKept)) events.pop_front();
  }
  added_.notify_all();
}

std::vector<NumberedEvent> EventLog::collect_locked(std::uint64_t number) const {
  const auto first_of = [number](const std::deque<NumberedEvent>& events) {
    return std::upper_bound(events.begin(), events.end(), number,
                            [](std::uint64_t wanted, const auto& one) { return wanted < one.number; });
  };
  std::vector<NumberedEvent> found;
  std::merge(first_of(events_[0]), events_[0].end(), first_of(events_[1]), events_[1].end(),
             std::back_inserter(found), [](const auto& a, const auto& b) { return a.number < b.number; });
  return found;
}

std::vector<recording::Event> EventLog::after(std::uint64_t& number, std::uint64_t& missed) const {
  const MutexLock lock(mutex_);
  if (number == last_) return {};
  std::vector<recording::Event> found;
  std::uint64_t kept = 0;
  for (NumberedEvent& one : collect_locked(number)) {
    ++kept;
    if (!one.is_in_records) found.push_back(std::move(one.event));
  }
  missed += last_ - number - kept;
  number = last_;
  return found;
}

std::vector<NumberedEvent> EventLog::all_after(std::uint64_t number) const {
  const MutexLock lock(mutex_);
  return number < last_ ? collect_locked(number) : std::vector<NumberedEvent>();
}

std::uint64_t EventLog::last() const {
  const MutexLock lock(mutex_);
  return last_;
}

bool EventLog::await_after(std::uint64_t number, std::chrono::milliseconds timeout) const {
  const auto until = std::chrono::steady_clock::now() + timeout;
  const MutexLock lock(mutex_);
  while (!ended_ && last_ <= number && added_.wait_until(mutex_, until)) {
  }
  return !ended_;
}

void EventLog::end() {
  {
    const MutexLock lock(mutex_);
    ended_ = true;
  }
  added_.notify_all();
}

}  // namespace hapticd::server
