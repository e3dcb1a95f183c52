#include "server/process/log.h"

#include <spdlog/async.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>

namespace hapticd::server {

namespace {

constexpr std::size_t kMaxLines = 2048;

/// Lines are written by a thread of its own: a reader that does not read (a terminal, a pipe) must hold up no
/// call, least of all a stop. If lines come faster than they are read, the oldest are dropped.
class Log {
 public:
  Log()
      : writer_(std::make_shared<spdlog::details::thread_pool>(kMaxLines, 1)),
        logger_(std::make_shared<spdlog::async_logger>(
            "hapticd", std::make_shared<spdlog::sinks::stderr_color_sink_mt>(), writer_,
            spdlog::async_overflow_policy::overrun_oldest)) {
    logger_->set_pattern("%Y-%m-%d %H:%M:%S.%e %^%l%$ %v");
    logger_->flush_on(spdlog::level::info);
  }
  /// The thread ends before what it writes to does.
  ~Log() { writer_.reset(); }
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  spdlog::logger& logger() { return *logger_; }

 private:
  std::shared_ptr<spdlog::details::thread_pool> writer_;
  const std::shared_ptr<spdlog::async_logger> logger_;
};

spdlog::logger& logger() {
  static Log log;
  return log.logger();
}

}  // namespace

void set_log_level(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      logger().set_level(spdlog::level::debug);
      break;
    case LogLevel::kInfo:
      logger().set_level(spdlog::level::info);
      break;
    case LogLevel::kWarning:
      logger().set_level(spdlog::level::warn);
      break;
    case LogLevel::kError:
      logger().set_level(spdlog::level::err);
      break;
    case LogLevel::kOff:
      logger().set_level(spdlog::level::off);
      break;
  }
}

void log_debug(std::string_view line) {
  logger().debug("{}", line);
}
void log_info(std::string_view line) {
  logger().info("{}", line);
}
void log_warning(std::string_view line) {
  logger().warn("{}", line);
}
void log_error(std::string_view line) {
  logger().error("{}", line);
}

}  // namespace hapticd::server
