#include "server/access/audit_log.h"

#include <fmt/format.h>
#include <pthread.h>
#define SD_JOURNAL_SUPPRESS_LOCATION
#include <systemd/sd-journal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "hal/recording/append_file.h"
#include "proto/text/utc_text.h"
#include "proto/text/utf8_text.h"
#include "server/process/log.h"

namespace hapticd::server {

namespace {

namespace fs = std::filesystem;

/// Beginning of every line.
constexpr std::string_view kBegin = R"({"time":")";

std::int64_t now_unix_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

hal::Error cannot_write(const std::string& path, const std::string& why) {
  return {"the audit log cannot be written", "[access] audit_file", path, why,
          "give hapticd the right to write there, or name another file"};
}

/// Path of the file that was begun `age` files ago: "audit.1.jsonl" of "audit.jsonl".
std::string path_of_older(const fs::path& path, std::size_t age) {
  if (age == 0) return path;
  return path.parent_path() / fmt::format("{}.{}{}", path.stem().string(), age, path.extension().string());
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
  std::string path;  ///< empty: no file
  std::uint64_t max_bytes = 0;
  std::optional<recording::AppendFile> file{};
  bool journal = false;
  bool failed = false;

  /// Opens the file again if it is no longer the one at its path, or was emptied; begins another one if
  /// `bytes` more are too many.
  std::optional<hal::Error> open_for(std::size_t bytes) {
    std::error_code failure;
    if (file && fs::file_size(path, failure) != file->size()) file.reset();
    if (file && file->size() > 0 && file->size() + bytes > max_bytes) {
      file.reset();
      for (std::size_t age = kKeptFiles - 1; age > 0; --age) {
        fs::rename(path_of_older(path, age - 1), path_of_older(path, age), failure);
      }
      if (failure) return cannot_write(path, "it cannot be renamed: " + failure.message());
    }
    if (file) return std::nullopt;
    auto opened = recording::AppendFile::open_or_create(path);
    if (!opened) return cannot_write(path, opened.error().what + ": " + opened.error().value);
    file.emplace(std::move(*opened));
    return std::nullopt;
  }

  /// False if the file does not have the line.
  bool append(const std::string& text) {
    if (path.empty()) return true;
    auto error = open_for(text.size() + 1);
    if (!error) error = file->append(text + '\n');
    if (error && !failed) log_error(error->text());
    failed = error.has_value();
    return !failed;
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

std::optional<hal::Error> AuditLog::check(const std::string& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (path.empty() || !fs::exists(status)) return std::nullopt;
  if (fs::is_regular_file(status)) {
    std::string begin(kBegin.size(), '\0');
    std::ifstream file(path, std::ios::binary);
    file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
    if (file.gcount() == 0 || begin == kBegin) return std::nullopt;
  }
  return hal::Error{"the audit log would go into something else", "[access] audit_file", path,
                    "a file that is not there yet, or an audit log", "name another file"};
}

hal::Result<std::unique_ptr<AuditLog>> AuditLog::open(const AccessConfig& config) {
  if (const auto error = check(config.audit_file)) return *error;
  auto sinks = std::make_unique<Sinks>();
  sinks->journal = config.audit_journal;
  if (!config.audit_file.empty()) {
    sinks->path = config.audit_file;
    sinks->max_bytes = static_cast<std::uint64_t>(config.audit_file_mb * 1e6);
    std::error_code ignored;
    fs::create_directories(fs::path(config.audit_file).parent_path(), ignored);
    if (const auto error = sinks->open_for(0)) return *error;
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
  if (sinks_->path.empty() && !sinks_->journal) return;
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
