#include "server/watchdog/endpoint_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "server/text/suggestion.h"
#include "server/text/utf8_text.h"

namespace hapticd::server {

namespace {

constexpr std::size_t kShownName = 64;

Refusal invalid_check_in(std::string what, const char* where, std::string value, std::string remedy) {
  return {RefusalKind::kInvalidArgument, {std::move(what), where, std::move(value), "", std::move(remedy)}};
}

EndpointTable::Time::duration time_of(double ms) {
  return std::chrono::duration_cast<EndpointTable::Time::duration>(
      std::chrono::duration<double, std::milli>(ms));
}

}  // namespace

EndpointTable::Time EndpointTable::Entry::lapses() const {
  return last + time_of(config.timeout_ms);
}

EndpointTable::EndpointTable(const WatchdogConfig& config, std::function<std::uint64_t()> new_nonce)
    : new_nonce_(std::move(new_nonce)) {
  for (const EndpointConfig& one : config.endpoints) {
    Entry entry;
    entry.config = one;
    entry.is_pedal = one.pedal;
    entries_.push_back(std::move(entry));
  }
}

Outcome<EndpointTable::Entry*> EndpointTable::find(const std::string& name) {
  std::vector<std::string> known;
  for (Entry& entry : entries_) {
    if (entry.config.name == name) return &entry;
    known.push_back(entry.config.name);
  }
  const std::string shown = shortened(repaired_utf8(name), kShownName);
  if (known.empty()) {
    return Refusal{RefusalKind::kNotFound,
                   {"this daemon has no watchdog", "CheckInRequest.endpoint", shown, "",
                    "add [[watchdog.endpoint]] to its configuration, and start it again"}};
  }
  return Refusal{RefusalKind::kNotFound,
                 {"no endpoint has this name", "CheckInRequest.endpoint", shown, comma_separated(known),
                  did_you_mean(shown, known, "use one of those, or add it to [[watchdog.endpoint]]")}};
}

Outcome<CheckInAnswer> EndpointTable::check_in(const CheckInRecord& check_in, Time now) {
  const auto found = find(check_in.endpoint);
  if (!found) return found.refusal();
  Entry& entry = **found;
  if (check_in.sender == 0) {
    return invalid_check_in("the sender is not named", "CheckInRequest.sender", "0",
                            "choose a random number when the program starts");
  }
  if (entry.is_pedal && !check_in.pressed && check_in.nonce != 0) {
    return invalid_check_in("a pedal does not say whether it is pressed", "CheckInRequest.pressed", "",
                            "set it in every check-in of '" + entry.config.name +
                                "'; hapticctl watchdog hold does with --pressed or --released");
  }
  lapse(now);
  if (entry.is_alive && entry.sender != check_in.sender) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"another sender checks in under this name", "endpoint '" + entry.config.name + "'",
                    entry.who, "one at a time", "end it, or give this one an endpoint of its own"},
                   Reason::kBusy};
  }
  if (check_in.nonce == 0) {
    entry.sender = check_in.sender;
    entry.nonce = new_nonce_();
    return CheckInAnswer{entry.nonce, false, entry.config.timeout_ms};
  }
  if (entry.sender != check_in.sender || entry.nonce != check_in.nonce) {
    ++entry.wrong_nonces;
    return Refusal{RefusalKind::kAborted,
                   {"the check-in has not the nonce of the last answer: it does not count",
                    "endpoint '" + entry.config.name + "'", fmt::format("{:016x}", check_in.nonce), "",
                    "begin again with nonce 0"}};
  }
  entry.nonce = new_nonce_();
  entry.was_heard = entry.is_alive = true;
  entry.last = now;
  entry.who = check_in.who;
  ++entry.check_ins;
  if (check_in.pressed) {
    entry.is_pedal = true;
    entry.is_released = !*check_in.pressed;
  }
  return CheckInAnswer{entry.nonce, true, entry.config.timeout_ms};
}

std::vector<std::string> EndpointTable::lapse(Time now) {
  std::vector<std::string> names;
  for (Entry& entry : entries_) {
    if (!entry.is_alive || now < entry.lapses()) continue;
    entry.is_alive = false;
    names.push_back(entry.config.name);
  }
  return names;
}

bool EndpointTable::all_alive() const {
  return std::all_of(entries_.begin(), entries_.end(), [](const Entry& e) { return e.is_alive; });
}

bool EndpointTable::any_released() const {
  return std::any_of(entries_.begin(), entries_.end(), [](const Entry& e) { return e.is_released; });
}

std::optional<EndpointTable::Time> EndpointTable::next_lapse() const {
  std::optional<Time> first;
  for (const Entry& entry : entries_) {
    if (entry.is_alive && (!first || entry.lapses() < *first)) first = entry.lapses();
  }
  return first;
}

std::vector<EndpointView> EndpointTable::views(Time now) const {
  std::vector<EndpointView> views;
  for (const Entry& entry : entries_) {
    EndpointView view;
    view.config = entry.config;
    view.is_pedal = entry.is_pedal;
    if (entry.was_heard) {
      const bool alive = entry.is_alive && now < entry.lapses();
      view.state = !alive              ? EndpointState::kMissing
                   : entry.is_released ? EndpointState::kReleased
                                       : EndpointState::kAlive;
      view.silent_ms = std::max(0.0, std::chrono::duration<double, std::milli>(now - entry.last).count());
    }
    view.checked_in_by = entry.who;
    view.check_ins = entry.check_ins;
    view.wrong_nonces = entry.wrong_nonces;
    views.push_back(std::move(view));
  }
  return views;
}

std::string missing_words(const std::vector<EndpointView>& views) {
  std::string words;
  for (const EndpointView& view : views) {
    if (view.state == EndpointState::kAlive) continue;
    if (!words.empty()) words += "; ";
    words += "endpoint '" + view.config.name + "' ";
    if (view.state == EndpointState::kAwaited) words += "has not checked in yet";
    if (view.state == EndpointState::kReleased) words += "reports its pedal released";
    if (view.state == EndpointState::kMissing) {
      words += fmt::format("was not heard of for {:.1f} s", 1e-3 * view.silent_ms);
    }
  }
  return words;
}

}  // namespace hapticd::server
