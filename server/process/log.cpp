#include "server/process/log.h"

#include <pthread.h>
#include <spdlog/async.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <memory>

#include "proto/text/utf8_text.h"

namespace hapticd::server {

namespace {

constexpr std::size_t kMaxLines = 2048;

std::atomic<spdlog::level::level_enum> level{spdlog::level::info};

/// A separate thread writes the lines: a reader that does not read (a terminal, a pipe) must hold up no call,
/// least of all a stop. If lines come faster than they are read, the oldest are dropped. The thread begins
/// with the first line, and has the signals and CPUs of the thread that writes it.
class Log {
 public:
  Log()
      : writer_(std::make_shared<spdlog::details::thread_pool>(
            kMaxLines, 1, [] { pthread_setname_np(pthread_self(), "log"); })),
        logger_(std::make_shared<spdlog::async_logger>(
            "hapticd", std::make_shared<spdlog::sinks::stderr_color_sink_mt>(), writer_,
            spdlog::async_overflow_policy::overrun_oldest)) {
    logger_->set_pattern("%Y-%m-%d %H:%M:%S.%e %^%l%$ %v");
    logger_->set_level(spdlog::level::trace);  // write_line() has decided
    logger_->flush_on(spdlog::level::info);
  }
  /// Ends the thread before what it writes to ends.
  ~Log() { writer_.reset(); }
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  spdlog::logger& logger() { return *logger_; }

 private:
  std::shared_ptr<spdlog::details::thread_pool> writer_;
  const std::shared_ptr<spdlog::async_logger> logger_;
};

/// Writes a line. It may contain text of a client: control characters are escaped, so it is one line and
/// moves no cursor.
void write_line(spdlog::level::level_enum of_line, std::string_view line) {
  if (of_line < level) return;
  static Log log;
  log.logger().log(of_line, "{}", text::printable(line));
}

}  // namespace

void set_log_level(LogLevel wanted) {
  switch (wanted) {
    case LogLevel::kDebug:
      level = spdlog::level::debug;
      break;
    case LogLevel::kInfo:
      level = spdlog::level::info;
      break;
    case LogLevel::kWarning:
      level = spdlog::level::warn;
      break;
    case LogLevel::kError:
      level = spdlog::level::err;
      break;
    case LogLevel::kOff:
      level = spdlog::level::off;
      break;
  }
}

void log_debug(std::string_view line) {
  write_line(spdlog::level::debug, line);
}
void log_info(std::string_view line) {
  write_line(spdlog::level::info, line);
}
void log_warning(std::string_view line) {
  write_line(spdlog::level::warn, line);
}
void log_error(std::string_view line) {
  write_line(spdlog::level::err, line);
}

}  // namespace hapticd::server
