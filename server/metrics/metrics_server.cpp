#include "server/metrics/metrics_server.h"

#include <prometheus/collectable.h>
#include <prometheus/exposer.h>

#include <exception>
#include <utility>
#include <vector>

namespace hapticd::server {

namespace {

/// Scrapers are few, and each asks a few times a minute.
constexpr const char* kThreads = "2";
constexpr const char* kTimeoutMs = "2000";

class Rig final : public prometheus::Collectable {
 public:
  explicit Rig(MetricsServer::Figures figures) : figures_(std::move(figures)) {}
  std::vector<prometheus::MetricFamily> Collect() const override { return metric_families(figures_()); }

 private:
  MetricsServer::Figures figures_;
};

}  // namespace

struct MetricsServer::State {
  std::shared_ptr<Rig> rig;
  prometheus::Exposer exposer;  // last: its threads end before the rig does
};

MetricsServer::MetricsServer(std::unique_ptr<State> state, std::uint16_t port)
    : state_(std::move(state)), port_(port) {}

MetricsServer::~MetricsServer() = default;

hal::Result<std::unique_ptr<MetricsServer>> MetricsServer::start(const ListenAddress& address,
                                                                 Figures figures) {
  ListenAddress in_numbers = address;
  if (address.host == "localhost") in_numbers.host = "127.0.0.1";
  const std::vector<std::string> options{"listening_ports", in_numbers.text(),    "num_threads",
                                         kThreads,          "request_timeout_ms", kTimeoutMs};
  try {
    std::unique_ptr<State> state(
        new State{std::make_shared<Rig>(std::move(figures)), prometheus::Exposer(options)});
    state->exposer.RegisterCollectable(state->rig);
    const int port = state->exposer.GetListeningPorts().at(0);
    return std::unique_ptr<MetricsServer>(
        new MetricsServer(std::move(state), static_cast<std::uint16_t>(port)));
  } catch (const std::exception&) {
    return hal::Error{"cannot listen for scrapes of metrics", "[metrics] listen", address.text(),
                      "an address of this machine and a port that no program uses", "choose another port"};
  }
}

}  // namespace hapticd::server
