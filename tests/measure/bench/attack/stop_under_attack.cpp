#include "tests/measure/bench/attack/stop_under_attack.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <exception>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "client/cpp/client.h"
#include "client/cpp/stop/stop.h"
#include "client/cpp/stop/stop_port.h"
#include "tests/measure/bench/attack/rows.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/report/child_process.h"
#include "tests/measure/report/report.h"
#include "tests/support/http2_flood.h"
#include "tests/support/process_memory.h"

namespace hapticd::bench {
namespace {

using Clock = std::chrono::steady_clock;
using report::fixed;

constexpr std::chrono::seconds kGiveUp{10};
/// Timeout of a stop by the service: each takes as long as a connection takes.
constexpr std::chrono::milliseconds kServiceTimeout{2000};

/// Daemon that listens everywhere, with a separate folder.
struct Victim {
  explicit Victim(const std::filesystem::path& folder, const std::filesystem::path& lab,
                  rlim_t max_descriptors);

  std::string address(const std::string& transport) const {
    if (transport == "unix") return "unix:" + (folder / "sock").string();
    return transport == "tls" ? "tls:127.0.0.1:" + std::to_string(tls_port) : daemon.address();
  }
  client::ClientOptions options(const std::string& transport) const {
    return {.address = address(transport),
            .timeout = kGiveUp,
            .certificates = certificates,
            .acquires_lease = true};
  }

  std::filesystem::path folder;
  std::string certificates;
  int tls_port;
  DaemonProcess daemon;
};

int free_port_pair() {
  for (;;) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    const int first = socket(AF_INET, SOCK_STREAM, 0);
    bind(first, reinterpret_cast<const sockaddr*>(&address), length);
    getsockname(first, reinterpret_cast<sockaddr*>(&address), &length);
    const int port = ntohs(address.sin_port);
    address.sin_port = htons(static_cast<std::uint16_t>(port + 1));
    const int second = socket(AF_INET, SOCK_STREAM, 0);
    const bool is_free = bind(second, reinterpret_cast<const sockaddr*>(&address), length) == 0;
    close(first);
    close(second);
    if (is_free) return port;
  }
}

DaemonSetup setup_of(const std::filesystem::path& folder, const std::filesystem::path& lab, int tls_port,
                     rlim_t max_descriptors) {
  DaemonSetup setup;
  setup.max_descriptors = max_descriptors;
  setup.model_store = (folder / "models.sqlite").string();
  setup.more_configuration = "[network]\nunix_socket = \"" + (folder / "sock").string() +
                             "\"\nlisten_tls = \"127.0.0.1:" + std::to_string(tls_port) +
                             "\"\ncertificates = \"" + (lab / "servers/localhost").string() + "\"\n";
  return setup;
}

Victim::Victim(const std::filesystem::path& its_folder, const std::filesystem::path& lab,
               rlim_t max_descriptors)
    : folder(its_folder),
      certificates((lab / "clients/bench").string()),
      tls_port(free_port_pair()),
      daemon(folder / "hapticd.log", setup_of(folder, lab, tls_port, max_descriptors)) {}

/// What is done to it until `done`, by the threads that this starts and ends.
using Attack =
    std::function<void(const Victim& victim, const std::string& transport, const std::atomic<bool>& done)>;

/// Runs so many threads that do one thing again and again; what fails is tried again.
void in_threads(int count, const std::atomic<bool>& done, const std::function<void()>& once) {
  std::vector<std::thread> threads;
  for (int i = 0; i < count; ++i) {
    threads.emplace_back([&] {
      while (!done) {
        try {
          once();
        } catch (const std::exception&) {
          std::this_thread::sleep_for(std::chrono::milliseconds(1));  // refused, or closed: again
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

Attack endless_headers(int connections) {
  return [connections](const Victim& victim, const std::string& transport, const std::atomic<bool>& done) {
    in_threads(connections, done, [&] {
      test::Http2Flood(victim.address(transport), victim.certificates).send_endless_header(13'000'000);
    });
  };
}

void resets(const Victim& victim, const std::string& transport, const std::atomic<bool>& done) {
  in_threads(2, done, [&] {
    test::Http2Flood(victim.address(transport), victim.certificates)
        .open_and_reset("/hapticd.v1.TelemetryService/Subscribe", 120'000);
  });
}

void unfinished_requests(const Victim& victim, const std::string& transport, const std::atomic<bool>& done) {
  in_threads(8, done, [&] {
    test::Http2Flood flood(victim.address(transport), victim.certificates);
    flood.open_unfinished("/hapticd.v1.SceneService/LoadScene", 99, 60'000);
    while (!done && !flood.is_closed()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  });
}

/// Connections that say nothing; those that are closed are opened again.
Attack idle_connections(int count) {
  return [count](const Victim& victim, const std::string& transport, const std::atomic<bool>& done) {
    sockaddr_storage peer{};
    socklen_t length = sizeof(sockaddr_in);
    const std::string address = victim.address(transport);
    if (transport == "unix") {
      auto& name = reinterpret_cast<sockaddr_un&>(peer);
      name.sun_family = AF_UNIX;
      std::strncpy(name.sun_path, address.c_str() + 5, sizeof name.sun_path - 1);
      length = sizeof name;
    } else {
      auto& name = reinterpret_cast<sockaddr_in&>(peer);
      name.sin_family = AF_INET;
      name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      name.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    }
    std::vector<int> open(static_cast<std::size_t>(count), -1);
    while (!done) {
      for (int& descriptor : open) {
        if (done) break;
        char byte = 0;
        if (descriptor >= 0 && recv(descriptor, &byte, 1, MSG_DONTWAIT) != 0) continue;
        if (descriptor >= 0) close(descriptor);
        descriptor = socket(peer.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
        connect(descriptor, reinterpret_cast<const sockaddr*>(&peer), length);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    for (const int descriptor : open) {
      if (descriptor >= 0) close(descriptor);
    }
  };
}

void waiting_calls(const Victim& victim, const std::string& transport, const std::atomic<bool>& done) {
  client::Client client(victim.options(transport));
  in_threads(64, done, [&] {
    v1::SetTargetRequest request;
    request.set_stiffness_n_per_mm(0.4);
    request.set_at_time_ns(client.rig_state(client::Histograms::kWithout).time_ns() + 2'000'000'000);
    client.set_target(request);
  });
}

/// 500 MB of rows that are parsed, one after the other.
Attack upload(double scale) {
  return [scale](const Victim& victim, const std::string& transport, const std::atomic<bool>& done) {
    in_threads(1, done, [&] {
      client::Client client(victim.options(transport));
      Rows rows(static_cast<std::uint64_t>(500e6 * scale));
      v1::RecordingDescription description;
      description.set_name("attack.csv");
      client::RecordingUpload sending = client.upload_recording(description);
      for (std::string piece = rows.next_piece(); !piece.empty() && !done; piece = rows.next_piece()) {
        sending.send(std::move(piece));
        if (!sending.taken(kGiveUp)) return;
      }
      sending.finish();
      while (!done && !sending.answer(std::chrono::milliseconds(100))) {
      }
    });
  };
}

void locked_store(const Victim& victim, const std::string& transport, const std::atomic<bool>& done) {
  const std::string script =
      "import sqlite3, sys, time\nd = sqlite3.connect(sys.argv[1])\nd.execute('BEGIN EXCLUSIVE')\n"
      "time.sleep(1000)\n";
  report::ChildProcess holder(
      {.command = {"/usr/bin/python3", "-c", script, (victim.folder / "models.sqlite").string()}});
  in_threads(8, done, [&] {
    client::Client client(victim.options(transport));
    client.stored_models({});
  });
}

struct Named {
  const char* name;
  Attack run;
  rlim_t max_descriptors = 8192;
};

std::vector<Named> attacks(double scale) {
  return {{"none", [](const Victim&, const std::string&, const std::atomic<bool>&) {}},
          {"endless_headers_4", endless_headers(4)},
          {"endless_headers_10", endless_headers(10)},
          {"resets", resets},
          {"unfinished_requests", unfinished_requests},
          {"idle_connections_4000", idle_connections(4000)},
          {"full_descriptors", idle_connections(400), 256},
          {"waiting_calls_64", waiting_calls},
          {"upload_500_mb", upload(scale)},
          {"locked_store", locked_store}};
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) throw std::runtime_error("no stop arrived");
  std::sort(values.begin(), values.end());
  const auto at = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size()))) - 1;
  return values[std::min(at, values.size() - 1)];
}

struct Lateness {
  std::vector<double> port_ms;     ///< each by a new connection
  std::vector<double> service_ms;  ///< the same; one that was not answered counts as its timeout
  std::vector<double> first_ms;    ///< by both at once
};

/// The time until the answer: the latch is set before.
Lateness measure(const Victim& victim, const std::string& transport, int stops) {
  Lateness late;
  const client::ClientOptions options = victim.options(transport);
  const auto ms_since = [](Clock::time_point began) {
    return std::chrono::duration<double, std::milli>(Clock::now() - began).count();
  };
  for (int i = 0; i < stops; ++i) {
    const auto began = Clock::now();
    try {
      client::stop_by_stop_port(options.address, options.certificates, kGiveUp);
    } catch (const client::Error&) {
      late.port_ms.push_back(1e3 * static_cast<double>(kGiveUp.count()));
      continue;
    }
    late.port_ms.push_back(ms_since(began));
  }
  for (int i = 0; i < std::max(1, stops / 20); ++i) {
    client::ClientOptions shorter = options;
    shorter.timeout = kServiceTimeout;
    const client::StopOutcome outcome = client::stop(shorter, "attack");
    late.first_ms.push_back(std::chrono::duration<double, std::milli>(outcome.after).count());
  }
  for (int i = 0; i < std::max(1, stops / 50); ++i) {
    client::ClientOptions shorter = options;
    shorter.timeout = kServiceTimeout;
    const auto began = Clock::now();
    try {
      client::Client(shorter).rig_info();
      late.service_ms.push_back(ms_since(began));
    } catch (const client::Error&) {
      late.service_ms.push_back(static_cast<double>(kServiceTimeout.count()));
    }
  }
  return late;
}

}  // namespace

int measure_stops_under_attack(report::Report& report, double scale) {
  const std::filesystem::path base = std::filesystem::absolute(report.folder()) / "attack";
  const std::filesystem::path lab = base / "lab";
  const report::ProgramRun made = report::run_program(
      {.command = {"bash", SOURCE_FOLDER "/deploy/make_certificates.sh", "--lab", "bench", "--out",
                   lab.string(), "--server", "localhost,127.0.0.1", "--client", "operator/bench"}},
      std::chrono::seconds(60));
  if (made.status != 0) throw std::runtime_error("no certificates: " + made.output);
  report::MarkdownTable table{{"attack", "transport", "stop port, median [ms]", "99.9 %", "worst",
                               "both paths, worst", "a call of the service, worst",
                               "growth of the memory [MB]", "serves afterwards"}};
  int crashes = 0;
  const int stops = std::max(100, static_cast<int>(2000 * scale));
  for (const Named& attack : attacks(scale)) {
    for (const std::string transport : {"tcp", "unix", "tls"}) {
      report::Report::note(std::string(attack.name) + " over " + transport + " …");
      const std::filesystem::path folder = base / (std::string(attack.name) + "_" + transport);
      std::filesystem::create_directories(folder);
      const report::Case conditions{{"attack", attack.name}, {"transport", transport}};
      report::Figure growth{
          .figure = "attack_rss_growth_mb", .conditions = conditions, .unit = "MB", .goal = 100.0};
      try {
        Victim victim(folder, lab, attack.max_descriptors);
        client::Client(victim.options(transport)).rig_state();
        const double before_mb = test::resident_mb(victim.daemon.pid());
        std::atomic<bool> done{false};
        std::thread attacking([&] {
          try {
            attack.run(victim, transport, done);
          } catch (const std::exception& error) {
            report::Report::note(std::string("the attack failed: ") + error.what());
          }
        });
        std::this_thread::sleep_for(
            std::chrono::duration<double>(0.2 + 2.0 * scale));  // until it is under way
        Lateness late;
        std::exception_ptr failure;
        try {
          late = measure(victim, transport, stops);
        } catch (...) {
          failure = std::current_exception();
        }
        done = true;
        attacking.join();
        if (failure) std::rethrow_exception(failure);
        growth.value = test::max_resident_mb(victim.daemon.pid()) - before_mb;
        bool serves = false;
        try {
          serves = client::Client(victim.options(transport)).rig_state().loop().running();
        } catch (const client::Error&) {
          // It does not.
        }
        serves = victim.daemon.stop() == 0 && serves;
        crashes += serves ? 0 : 1;
        for (const double share : {0.5, 0.999, 1.0}) {
          report::Case at = conditions;
          at.push_back({"quantile", share});
          report::Figure figure{.figure = "stop_late_ms",
                                .conditions = at,
                                .value = quantile(late.port_ms, share),
                                .unit = "ms"};
          if (share == 0.999) figure.goal = 20.0;
          report.add(figure);
        }
        table.add_row({attack.name, transport, fixed(quantile(late.port_ms, 0.5), 2),
                       fixed(quantile(late.port_ms, 0.999), 1), fixed(quantile(late.port_ms, 1.0), 1),
                       fixed(quantile(late.first_ms, 1.0), 1), fixed(quantile(late.service_ms, 1.0), 0),
                       fixed(*growth.value, 0), serves ? "yes" : "no"});
      } catch (const std::exception& error) {
        growth.failed = error.what();
        report.add(
            {.figure = "stop_late_ms", .conditions = conditions, .unit = "ms", .failed = error.what()});
        table.add_row({attack.name, transport, report::kNoNumber, report::kNoNumber, report::kNoNumber,
                       report::kNoNumber, report::kNoNumber, report::kNoNumber, error.what()});
        ++crashes;
      }
      report.add(growth);
    }
  }
  report.add_table(
      "stops", "How late a stop comes under attack", table,
      "From the call to its answer, " + std::to_string(stops) +
          " stops each, every one by a connection of its own. The attack uses the same transport.");
  return crashes;
}

}  // namespace hapticd::bench
