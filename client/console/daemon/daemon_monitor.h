#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "client/console/daemon/rpc_bridge.h"
#include "hapticd/v1/access.pb.h"

namespace hapticd::console {

/// Asks the daemon twice a second whether it is there; a console for all reports with it where its pages are.
/// A daemon that is gone is noticed with the next question, one that hangs after 1.4 s. Used by the console's
/// thread alone.
class DaemonMonitor : public std::enable_shared_from_this<DaemonMonitor> {
 public:
  struct Parts {
    RpcBridge& bridge;
    std::optional<v1::ReportConsoleRequest> report;   ///< of a console for all
    std::function<void(std::function<void()>)> post;  ///< runs a function in the console's thread
    std::function<void()> on_loss;
    std::function<void()> on_first_answer;                   ///< also when it is that no daemon is there
    std::function<void(const std::string& why)> on_refusal;  ///< when the answer becomes a refusal
  };
  DaemonMonitor(const boost::asio::any_io_executor& executor, Parts parts)
      : parts_(std::move(parts)), timer_(executor) {}

  void start();
  bool daemon_is_there() const;
  /// Asks at once, e.g. as a call has failed.
  void look();

 private:
  using Clock = std::chrono::steady_clock;
  void beat();
  void answered(const grpc::Status& status, bool reported);
  void lose();
  void note_refusal(const std::string& why);

  const Parts parts_;
  boost::asio::steady_timer timer_;
  Clock::time_point heard_at_{};
  bool is_asking_ = false;
  bool is_there_ = false;
  bool has_answer_ = false;
  std::string refusal_;  ///< of the last report
  int unreported_ = 0;   ///< questions since then that were not reports
};

}  // namespace hapticd::console
