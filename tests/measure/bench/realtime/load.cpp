#include "tests/measure/bench/realtime/load.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <functional>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "client/cpp/client.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/bench/live/subscriber.h"

namespace hapticd::bench {
namespace {

constexpr int kStreamsPerProcess = 8;
constexpr std::chrono::seconds kEnds{20};

/// A program that is asked to end by a signal.
class ProgramLoad : public Load {
 public:
  ProgramLoad(std::vector<std::string> command, const std::filesystem::path& log, int ends_by = SIGTERM)
      : process_({.command = std::move(command), .output = log}), ends_by_(ends_by) {}
  ~ProgramLoad() override {
    process_.signal(ends_by_);
    process_.wait(kEnds);
  }

 private:
  report::ChildProcess process_;
  int ends_by_;
};

class SubscribersLoad final : public Load {
 public:
  SubscribersLoad(const std::string& address, double seconds, const std::filesystem::path& folder,
                  int streams) {
    for (int left = streams; left > 0; left -= kStreamsPerProcess) {
      processes_.push_back(std::make_unique<SubscriberProcess>(
          address, seconds, folder / ("load_" + std::to_string(left) + ".json"),
          std::min(left, kStreamsPerProcess)));
    }
  }

 private:
  std::vector<std::unique_ptr<SubscriberProcess>> processes_;
};

/// Calls of a client, one after the other, with pauses in between.
class CallsLoad : public Load {
 public:
  CallsLoad(const std::string& address, std::chrono::milliseconds pause,
            std::function<void(client::Client&, int)> call)
      : client_({.address = address}),
        thread_([this, pause, call = std::move(call)](const std::stop_token& stop) {
          for (int i = 0; !stop.stop_requested(); ++i) {
            try {
              call(client_, i);
            } catch (const client::Error&) {  // a refusal is an answer, too
            }
            std::this_thread::sleep_for(pause);
          }
        }) {}

 protected:
  /// Ends the calls; the client is free again.
  client::Client& end() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
    return client_;
  }

 private:
  client::Client client_;
  std::jthread thread_;
};

class ModelSwaps final : public CallsLoad {
 public:
  explicit ModelSwaps(const std::string& address)
      : CallsLoad(address, std::chrono::milliseconds(100), swap) {}
  ~ModelSwaps() override {
    try {
      end().load_scene({.name = "tap_1d"});
    } catch (
        const client::Error&) {  // the next load starts from another scene; it is the loop that is judged
    }
  }

 private:
  static void swap(client::Client& client, int i) {
    client.load_scene(
        {.name = "explore_rod", .object_model = i % 2 == 0 ? "foam_ball_3d" : "rubber_ball_3d"});
  }
};

/// A fit that runs in the daemon on what the simulated hand presses.
class IdentificationLoad final : public Load {
 public:
  IdentificationLoad(const std::string& address, double seconds) : address_(address) {
    v1::StartIdentificationRequest request;
    request.mutable_contact();
    request.set_object("load");
    request.set_time_limit_s(std::max(1.0, std::ceil(seconds + 5.0)));
    client::Client({.address = address}).start_identification(request);
  }
  ~IdentificationLoad() override {
    try {
      client::Client client({.address = address_});
      client.cancel_identification("");
      v1::HandProgram taps;
      taps.set_kind(v1::HAND_PROGRAM_KIND_TAP);
      taps.set_repetitions(-1);
      client.set_hand_program(taps);
    } catch (const client::Error&) {  // it was over before
    }
  }

 private:
  std::string address_;
};

void set_target(client::Client& client, int i) {
  v1::SetTargetRequest request;
  request.set_stiffness_n_per_mm(i % 2 == 0 ? 0.3 : 0.6);
  client.set_target(request);
  if (i % 20 == 0) client.rig_state();
  if (i % 100 == 0) client.scenes();
}

class Both final : public Load {
 public:
  Both(std::unique_ptr<Load> a, std::unique_ptr<Load> b) : a_(std::move(a)), b_(std::move(b)) {}

 private:
  std::unique_ptr<Load> a_;
  std::unique_ptr<Load> b_;
};

template <int kStreams>
std::unique_ptr<Load> subscribers(const std::string& address, double seconds,
                                  const std::filesystem::path& folder) {
  return std::make_unique<SubscribersLoad>(address, seconds, folder, kStreams);
}

std::unique_ptr<Load> none(const std::string&, double, const std::filesystem::path&) {
  return nullptr;
}

std::unique_ptr<Load> calls(const std::string& address, double, const std::filesystem::path&) {
  return std::make_unique<CallsLoad>(address, std::chrono::milliseconds(2), set_target);
}

std::unique_ptr<Load> swaps(const std::string& address, double, const std::filesystem::path&) {
  return std::make_unique<ModelSwaps>(address);
}

std::unique_ptr<Load> identification(const std::string& address, double seconds,
                                     const std::filesystem::path&) {
  return std::make_unique<IdentificationLoad>(address, seconds);
}

std::unique_ptr<Load> recording(const std::string& address, double, const std::filesystem::path& folder) {
  return std::make_unique<ProgramLoad>(
      std::vector<std::string>{(program_folder() / "hapticctl").string(), "--server", address, "telemetry",
                               "record", (folder / "load.csv").string()},
      folder / "load_record.log", SIGINT);
}

std::unique_ptr<Load> stress(const std::string&, double, const std::filesystem::path& folder) {
  const long cpus = sysconf(_SC_NPROCESSORS_ONLN);  // all of them, the loop's too
  try {
    return std::make_unique<ProgramLoad>(
        std::vector<std::string>{"stress-ng", "--taskset", "0-" + std::to_string(cpus - 1), "--cpu",
                                 std::to_string(cpus), "--vm", "1", "--vm-bytes", "64M", "--quiet"},
        folder / "load_stress.log");
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::no_such_file_or_directory) throw;
    throw std::runtime_error("stress-ng is not installed; apt-get install stress-ng");
  }
}

std::unique_ptr<Load> stress_and_subscribers(const std::string& address, double seconds,
                                             const std::filesystem::path& folder) {
  return std::make_unique<Both>(stress(address, seconds, folder), subscribers<8>(address, seconds, folder));
}

}  // namespace

const std::vector<LoadType>& loads() {
  static const std::vector<LoadType> all{
      {"idle", LoadKind::kNone, none, true},
      {"1 subscriber", LoadKind::kService, subscribers<1>},
      {"8 subscribers", LoadKind::kService, subscribers<8>, true},
      {"64 subscribers", LoadKind::kService, subscribers<64>},
      {"calls", LoadKind::kService, calls},
      {"identification", LoadKind::kService, identification},
      {"models swapped", LoadKind::kService, swaps},
      {"recording", LoadKind::kService, recording},
      {"stress-ng", LoadKind::kMachine, stress, true},
      {"stress-ng, 8 subscribers", LoadKind::kMachine, stress_and_subscribers},
  };
  return all;
}

}  // namespace hapticd::bench
