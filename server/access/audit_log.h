#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>

#include "hal/error.h"
#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"
#include "proto/text/report_rate.h"
#include "server/config/access_config.h"

namespace hapticd::server {

/// One refused or state-changing call.
struct AuditLine {
  std::int64_t unix_ns = 0;  ///< when it ended; 0: filled in
  std::uint64_t tick = 0;    ///< of the loop, at that time
  std::string identity;
  std::string role;
  std::string peer;
  std::uint64_t lease = 0;  ///< number of the state of control it was admitted under; 0 = none needed
  std::string method;
  std::string arguments;  ///< as text, shortened
  std::string outcome;    ///< name of the status code
  std::string problem;    ///< why it was refused
  std::optional<std::uint64_t> effective_tick;
  std::uint64_t refusals_not_written = 0;  ///< of this identity since its last line; filled in
};

/// Turns a line into JSON, without its end.
std::string to_json(const AuditLine& line);

/// Writes lines to a file that is rotated, and to the journal of systemd, on its own thread. write() never
/// waits for a disk: what does not fit into the queue, or the file, is dropped and counted, and the count is
/// written.
/// Refused calls, which anyone may repeat as fast as they can, are written up to kRefusalsPerS for each
/// identity, so that none can rotate the lines of the others away; how many more there were is in its next
/// line.
class AuditLog {
 public:
  static constexpr std::size_t kMaxQueue = 4096;
  static constexpr std::size_t kKeptFiles = 5;
  static constexpr int kRefusalsPerS = 20;

  /// An error if something is at the path of the file that is not an audit log; nothing is opened for
  /// writing.
  static std::optional<hal::Error> check(const std::string& path);
  /// Opens the log. An error if check() finds one, if the file cannot be written to or if another process
  /// writes it.
  static hal::Result<std::unique_ptr<AuditLog>> open(const AccessConfig& config);
  /// Writes what is queued, then ends.
  ~AuditLog();
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;

  void write(AuditLine line);
  /// Shows every line to `look` as well, in the thread of the call: must be short. Set before there are
  /// calls.
  void show_to(Callback<void(const AuditLine&)> look) { look_ = std::move(look); }
  std::uint64_t dropped() const;

 private:
  struct Sinks;
  explicit AuditLog(std::unique_ptr<Sinks> sinks);
  void run();
  /// Returns false if the identity of `line` has had too many refusals of late.
  bool admit(AuditLine& line) REQUIRES(mutex_);

  const std::unique_ptr<Sinks> sinks_;
  Callback<void(const AuditLine&)> look_;
  mutable Mutex mutex_;
  Condition arrived_;
  std::deque<AuditLine> queue_ GUARDED_BY(mutex_);
  std::unordered_map<std::string, text::ReportRate> refusals_ GUARDED_BY(mutex_);  ///< by identity
  std::uint64_t dropped_ GUARDED_BY(mutex_) = 0;
  std::uint64_t reported_dropped_ GUARDED_BY(mutex_) = 0;
  bool ending_ GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
