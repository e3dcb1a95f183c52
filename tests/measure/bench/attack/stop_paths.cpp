#include "tests/measure/bench/attack/stop_paths.h"

#include <linux/capability.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <ctime>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "client/cpp/channel.h"
#include "client/cpp/client.h"
#include "client/cpp/stop/stop.h"
#include "client/cpp/stop/stop_port.h"
#include "hapticd/v1/safety.grpc.pb.h"

namespace hapticd::bench {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kTimeout{10'000};
/// Timeout of a stop by the service: each may take as long as a connection takes.
constexpr milliseconds kServiceTimeout{2000};
/// More stops a second than are written to the audit log would not be found there.
constexpr milliseconds kSignalPause{60};
/// Pause between two stops. Handshakes one after the other in a thread with a real-time priority would use up
/// the time that Linux grants all such threads, and then it holds them back for 50 ms.
constexpr milliseconds kBetweenStops{1};
/// Pause after other stops.
constexpr milliseconds kAuditPause{1100};

double ms_since(Clock::time_point began) {
  return std::chrono::duration<double, std::milli>(Clock::now() - began).count();
}

/// Time in which this thread could have run, but waited for a processor, since it began.
double waited_ms() {
  double on_processor_ns = 0.0;
  double waited_ns = 0.0;
  std::ifstream("/proc/thread-self/schedstat") >> on_processor_ns >> waited_ns;
  return 1e-6 * waited_ns;
}

/// Stops by `stop`, which returns false if it did not come.
MeasuredStops repeat(int count, std::chrono::seconds max_time, milliseconds timeout,
                     const std::function<bool()>& stop) {
  MeasuredStops stops;
  const auto end = Clock::now() + max_time;
  while (static_cast<int>(stops.late_ms.size()) < count && Clock::now() < end) {
    const double waited_before_ms = waited_ms();
    const auto began = Clock::now();
    const bool came = stop();
    stops.late_ms.push_back(came ? ms_since(began) : static_cast<double>(timeout.count()));
    stops.own_wait_ms.push_back(waited_ms() - waited_before_ms);
    std::this_thread::sleep_for(kBetweenStops);
  }
  return stops;
}

MeasuredStops by_stop_port(const Victim& victim, const std::string& transport, int count,
                           std::chrono::seconds max_time) {
  const std::string address = victim.address(transport);
  return repeat(count, max_time, kTimeout, [&] {
    try {
      client::stop_by_stop_port(address, victim.certificates(), kTimeout);
      return true;
    } catch (const client::Error&) {
      return false;
    }
  });
}

/// Client of a user who may raise no priority, whatever this program may.
class NoPriority {
 public:
  NoPriority() {
    syscall(SYS_capget, &header_, before_.data());
    auto without = before_;
    without[CAP_TO_INDEX(CAP_SYS_NICE)].effective &= ~CAP_TO_MASK(CAP_SYS_NICE);
    syscall(SYS_capset, &header_, without.data());
  }
  ~NoPriority() { syscall(SYS_capset, &header_, before_.data()); }
  NoPriority(const NoPriority&) = delete;
  NoPriority& operator=(const NoPriority&) = delete;

 private:
  __user_cap_header_struct header_{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> before_{};
};

MeasuredStops by_stop_port_ordinary(const Victim& victim, const std::string& transport, int count,
                                    std::chrono::seconds max_time) {
  const NoPriority among;
  return by_stop_port(victim, transport, count, max_time);
}

bool stop_by_service(const std::shared_ptr<grpc::Channel>& channel) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kServiceTimeout);
  v1::StopResponse answer;
  return v1::SafetyService::NewStub(channel)->Stop(&context, {}, &answer).ok();
}

std::shared_ptr<grpc::Channel> new_channel(const Victim& victim, const std::string& transport) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // else it would be the connection of another
  return client::make_channel(victim.options(transport), arguments);
}

MeasuredStops by_service_kept(const Victim& victim, const std::string& transport, int count,
                              std::chrono::seconds max_time) {
  const auto channel = new_channel(victim, transport);
  // How a new connection fares is measured by itself.
  channel->WaitForConnected(std::chrono::system_clock::now() + std::chrono::seconds(20));
  return repeat(count, max_time, kServiceTimeout, [&] { return stop_by_service(channel); });
}

MeasuredStops by_service_new(const Victim& victim, const std::string& transport, int count,
                             std::chrono::seconds max_time) {
  return repeat(count, max_time, kServiceTimeout,
                [&] { return stop_by_service(new_channel(victim, transport)); });
}

MeasuredStops by_both(const Victim& victim, const std::string& transport, int count,
                      std::chrono::seconds max_time) {
  client::ClientOptions options = victim.options(transport);
  options.timeout = kTimeout;
  std::vector<double> late_ms;
  repeat(count, max_time, kTimeout, [&] {
    try {
      const client::StopOutcome outcome = client::stop(options, "attack");
      late_ms.push_back(std::chrono::duration<double, std::milli>(outcome.after).count());
      return true;
    } catch (const client::Error&) {
      late_ms.push_back(static_cast<double>(kTimeout.count()));
      return false;
    }
  });
  return {late_ms, {}};
}

/// Lines that are added to the audit log.
class AuditFollower {
 public:
  explicit AuditFollower(const std::filesystem::path& path) : path_(path) {
    file_.open(path_);
    file_.seekg(0, std::ios::end);
  }
  /// Time at which the next stop by a signal was served, s since 1970; nothing within `timeout`.
  std::optional<double> next_signal(milliseconds timeout) {
    const auto until = Clock::now() + timeout;
    while (Clock::now() < until) {
      if (!std::getline(file_, line_)) {
        file_.clear();
        std::this_thread::sleep_for(milliseconds(1));
        continue;
      }
      if (line_.find("\"by a signal\"") == std::string::npos) continue;
      return seconds_of(nlohmann::json::parse(line_).at("time").get<std::string>());
    }
    return std::nullopt;
  }

 private:
  /// "2026-11-28T15:49:11.123456Z".
  static double seconds_of(const std::string& utc) {
    std::tm parts{};
    const char* rest = strptime(utc.c_str(), "%Y-%m-%dT%H:%M:%S", &parts);
    return static_cast<double>(timegm(&parts)) + std::stod(std::string("0") + rest);
  }

  std::filesystem::path path_;
  std::ifstream file_;
  std::string line_;
};

MeasuredStops by_signal(const Victim& victim, const std::string& /*transport*/, int count,
                        std::chrono::seconds max_time) {
  std::this_thread::sleep_for(kAuditPause);
  AuditFollower audit(victim.audit());
  std::vector<double> late_ms;
  repeat(count, max_time, kTimeout, [&] {
    const double sent_s =
        std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    kill(victim.pid(), SIGUSR1);
    const auto served_s = audit.next_signal(kTimeout);
    late_ms.push_back(served_s ? 1e3 * (*served_s - sent_s) : static_cast<double>(kTimeout.count()));
    std::this_thread::sleep_for(kSignalPause);
    return served_s.has_value();
  });
  return {late_ms, {}};
}

}  // namespace

const std::vector<StopPath>& stop_paths() {
  static const std::vector<StopPath> kPaths{{"stop_port", 1.0, false, by_stop_port},
                                            {"stop_port_ordinary", 1.0, true, by_stop_port_ordinary},
                                            {"signal", 0.1, false, by_signal},
                                            {"both", 0.2, true, by_both},
                                            {"service_kept", 1.0, true, by_service_kept},
                                            {"service_new", 0.2, true, by_service_new}};
  return kPaths;
}

}  // namespace hapticd::bench
