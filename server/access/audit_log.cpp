#include "server/access/audit_log.h"

#include <fmt/format.h>
#include <pthread.h>
#include <spdlog/sinks/rotating_file_sink.h>
#define SD_JOURNAL_SUPPRESS_LOCATION
#include <systemd/sd-journal.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "proto/text/utc_text.h"
#include "proto/text/utf8_text.h"
#include "server/process/log.h"

namespace hapticd::server {

namespace {

std::int64_t now_unix_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

std::string to_json(const AuditLine& line) {
  nlohmann::ordered_json json = {{"time", text::utc_text(line.unix_ns, 6)},
                                 {"tick", line.tick},
                                 {"identity", line.identity},
                                 {"role", line.role},
                                 {"peer", line.peer},
                                 {"method", line.method},
                                 {"outcome", line.outcome}};
  if (line.lease != 0) json["lease"] = line.lease;
  if (!line.arguments.empty()) json["arguments"] = line.arguments;
  if (!line.problem.empty()) json["problem"] = line.problem;
  if (line.effective_tick) json["effective_tick"] = *line.effective_tick;
  if (line.refusals_not_written != 0) json["refusals_not_written"] = line.refusals_not_written;
  // JSON itself escapes no C1.
  return text::printable(json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

struct AuditLog::Sinks {
  std::unique_ptr<spdlog::sinks::rotating_file_sink_st> file;
  bool journal = false;
  bool failed = false;

  /// False if the file does not have the line. What it has of it is taken out again: the next one would be
  /// written behind it.
  bool append(const std::string& text) {
    if (!file) return true;
    std::error_code no_size;
    const std::uintmax_t before = std::filesystem::file_size(file->filename(), no_size);
    try {
      file->log(spdlog::details::log_msg({}, spdlog::level::info, text));
      file->flush();
      failed = false;
      return true;
    } catch (const spdlog::spdlog_ex& error) {
      if (!std::exchange(failed, true)) log_error(std::string("the audit file: ") + error.what());
    }
    std::error_code ignored;
    // A file that was begun meanwhile is smaller.
    const bool is_torn = !no_size && std::filesystem::file_size(file->filename(), ignored) > before;
    if (is_torn && !ignored) std::filesystem::resize_file(file->filename(), before, ignored);
    return false;
  }

  /// Writes to both; false if the file does not have the line.
  bool write(const std::string& text, const AuditLine* line) {
    const bool is_written = append(text);
    if (!journal) return is_written;
    if (line == nullptr) {
      sd_journal_send("MESSAGE=%s", text.c_str(), "SYSLOG_IDENTIFIER=hapticd-audit", "PRIORITY=4", nullptr);
      return is_written;
    }
    sd_journal_send("MESSAGE=%s", text.c_str(), "SYSLOG_IDENTIFIER=hapticd-audit", "PRIORITY=6",
                    "HAPTICD_IDENTITY=%s", text::printable(line->identity).c_str(), "HAPTICD_METHOD=%s",
                    text::printable(line->method).c_str(), "HAPTICD_OUTCOME=%s", line->outcome.c_str(),
                    nullptr);
    return is_written;
  }
};

hal::Result<std::unique_ptr<AuditLog>> AuditLog::open(const AccessConfig& config) {
  auto sinks = std::make_unique<Sinks>();
  sinks->journal = config.audit_journal;
  if (!config.audit_file.empty()) {
    try {
      const auto bytes = static_cast<std::size_t>(config.audit_file_mb * 1e6);
      sinks->file =
          std::make_unique<spdlog::sinks::rotating_file_sink_st>(config.audit_file, bytes, kKeptFiles - 1);
      sinks->file->set_pattern("%v");
    } catch (const spdlog::spdlog_ex& error) {
      return hal::Error{"the audit log cannot be written", "[access] audit_file", config.audit_file,
                        error.what(), "give hapticd the right to write there, or name another file"};
    }
  }
  return std::unique_ptr<AuditLog>(new AuditLog(std::move(sinks)));
}

AuditLog::AuditLog(std::unique_ptr<Sinks> sinks) : sinks_(std::move(sinks)), thread_([this] { run(); }) {}

AuditLog::~AuditLog() {
  {
    const MutexLock lock(mutex_);
    ending_ = true;
  }
  arrived_.notify_one();
  thread_.join();
}

void AuditLog::write(AuditLine line) {
  if (line.unix_ns == 0) line.unix_ns = now_unix_ns();
  if (look_) look_(line);
  if (!sinks_->file && !sinks_->journal) return;
  {
    const MutexLock lock(mutex_);
    if (!admit(line)) return;
    if (queue_.size() >= kMaxQueue) {
      ++dropped_;
      return;
    }
    queue_.push_back(std::move(line));
  }
  arrived_.notify_one();
}

bool AuditLog::admit(AuditLine& line) {
  constexpr std::size_t kMaxIdentities = 1024;  // beyond that the others share one
  // A call that was admitted under a lease is always written: it may have acted before it failed.
  const bool is_refused = line.outcome != "OK" && line.lease == 0;
  auto own = refusals_.find(line.identity);
  if (own == refusals_.end()) {
    if (!is_refused) return true;
    const bool is_full = refusals_.size() >= kMaxIdentities;
    own = refusals_.try_emplace(is_full ? std::string{} : line.identity, kRefusalsPerS).first;
  }
  if (!is_refused) {
    line.refusals_not_written = own->second.take_counted();
    return true;
  }
  const auto before = own->second.take(text::ReportRate::Time::clock::now());
  line.refusals_not_written = before.value_or(0);
  return before.has_value();
}

std::uint64_t AuditLog::dropped() const {
  const MutexLock lock(mutex_);
  return dropped_;
}

void AuditLog::run() {
  pthread_setname_np(pthread_self(), "audit");
  MutexLock lock(mutex_);
  for (;;) {
    while (!ending_ && queue_.empty()) arrived_.wait(mutex_);
    if (queue_.empty()) return;
    const std::deque<AuditLine> lines = std::exchange(queue_, {});
    const std::uint64_t dropped = dropped_ - reported_dropped_;
    lock.unlock();
    std::uint64_t lost = 0;
    for (const AuditLine& line : lines) lost += sinks_->write(to_json(line), &line) ? 0 : 1;
    const bool is_reported =
        dropped > 0 && sinks_->write(fmt::format(R"({{"time":"{}","dropped":{}}})",
                                                 text::utc_text(now_unix_ns(), 6), dropped),
                                     nullptr);
    lock.lock();
    dropped_ += lost;
    if (is_reported) reported_dropped_ += dropped;
  }
}

}  // namespace hapticd::server
