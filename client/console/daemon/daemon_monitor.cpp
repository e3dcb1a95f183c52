#include "client/console/daemon/daemon_monitor.h"

#include <utility>

namespace hapticd::console {

namespace {

constexpr std::chrono::milliseconds kPeriod{200};
constexpr std::chrono::milliseconds kBetweenQuestions{500};
constexpr std::chrono::milliseconds kStandsStill{1400};
constexpr std::chrono::milliseconds kAnswerTime{1000};
constexpr int kUnreported = 20;
constexpr const char* kHealthPath = "/grpc.health.v1.Health/Check";
constexpr const char* kReportPath = "/hapticd.v1.AccessService/ReportConsole";

}  // namespace

void DaemonMonitor::start() {
  look();
  beat();
}

bool DaemonMonitor::daemon_is_there() const {
  return is_there_;
}

void DaemonMonitor::beat() {
  timer_.expires_after(kPeriod);
  timer_.async_wait([weak = weak_from_this()](boost::system::error_code error) {
    const auto here = weak.lock();
    if (!here || error) return;
    const auto silence = Clock::now() - here->heard_at_;
    if (here->is_there_ && silence > kStandsStill) here->lose();
    if (!here->is_there_ || silence > kBetweenQuestions) here->look();
    here->beat();
  });
}

void DaemonMonitor::look() {
  if (is_asking_) return;
  is_asking_ = true;
  // A daemon that has refused this console is not asked again and again: each refusal is a line in its log.
  const bool reports = parts_.report && (refusal_.empty() || ++unreported_ >= kUnreported);
  if (reports) unreported_ = 0;
  parts_.bridge.call_raw(
      reports ? kReportPath : kHealthPath, reports ? parts_.report->SerializeAsString() : std::string(), {},
      [weak = weak_from_this(), post = parts_.post, reports](const grpc::Status& status, const std::string&) {
        post([weak, status, reports] {
          if (const auto here = weak.lock()) here->answered(status, reports);
        });
      },
      kAnswerTime);
}

void DaemonMonitor::answered(const grpc::Status& status, bool reported) {
  is_asking_ = false;
  const grpc::StatusCode code = status.error_code();
  const bool is_silent = code == grpc::StatusCode::DEADLINE_EXCEEDED || code == grpc::StatusCode::CANCELLED;
  if (code == grpc::StatusCode::UNAVAILABLE) {
    lose();
  } else if (!is_silent) {
    heard_at_ = Clock::now();
    is_there_ = true;
    if (reported) note_refusal(status.ok() ? std::string() : status.error_message());
  }
  if (!std::exchange(has_answer_, true)) parts_.on_first_answer();
}

void DaemonMonitor::note_refusal(const std::string& why) {
  if (why != refusal_ && !why.empty()) parts_.on_refusal(why);
  refusal_ = why;
}

void DaemonMonitor::lose() {
  if (std::exchange(is_there_, false)) parts_.on_loss();
}

}  // namespace hapticd::console
