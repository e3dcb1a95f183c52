#include "tests/measure/bench/attack/stop_under_attack.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/cpp/client.h"
#include "tests/measure/bench/attack/attacks.h"
#include "tests/measure/bench/attack/stop_paths.h"
#include "tests/measure/bench/attack/victim.h"
#include "tests/measure/report/report.h"
#include "tests/support/process_memory.h"

namespace hapticd::bench {
namespace {

using Clock = std::chrono::steady_clock;
using report::fixed;

constexpr const char* kTransports[] = {"tcp", "unix", "tls"};
constexpr double kGoalMs = 20.0;
constexpr int kStops = 1000;
constexpr std::chrono::seconds kMaxTime{20};
constexpr std::chrono::seconds kPatience{60};

double quantile(std::vector<double> values, double share) {
  if (values.empty()) throw std::runtime_error("no stop was tried");
  std::sort(values.begin(), values.end());
  const auto at = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size()))) - 1;
  return values[std::min(at, values.size() - 1)];
}

double late_share(const std::vector<double>& late_ms) {
  const auto late = std::count_if(late_ms.begin(), late_ms.end(), [](double ms) { return ms > kGoalMs; });
  return static_cast<double>(late) / static_cast<double>(late_ms.size());
}

struct Outcome {
  std::map<std::string, std::vector<double>> late_ms;  ///< by the name of the path
  double growth_mb = 0.0;
  long inputs = 0;
  bool serves = false;  ///< afterwards, and ended in order
};

/// An attack that runs as long as this lives.
class Running {
 public:
  Running(const Attack& attack, const Victim& victim, const std::string& transport)
      : thread_([&attack, &victim, transport, this] {
          try {
            attack.run(victim, transport, state_);
          } catch (const std::exception& error) {
            problem_ = error.what();
          }
        }) {
    const auto until = Clock::now() + kPatience;
    while (!state_.under_way && Clock::now() < until)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
  ~Running() { end(); }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  /// Returns how many inputs it tried. Throws std::runtime_error if it was not an attack.
  long end() {
    state_.done = true;
    if (thread_.joinable()) thread_.join();
    if (!problem_.empty()) throw std::runtime_error("the attack failed: " + std::exchange(problem_, {}));
    return state_.inputs;
  }

 private:
  AttackState state_;
  std::string problem_;
  std::thread thread_;
};

/// Client that stops, which runs ahead of the attackers, which take the same processors here: elsewhere it has one of its
/// own.
class OwnPriority {
 public:
  OwnPriority() {
    pthread_getschedparam(pthread_self(), &policy_, &before_);
    const sched_param raised{.sched_priority = sched_get_priority_min(SCHED_RR)};
    pthread_setschedparam(pthread_self(), SCHED_RR, &raised);  // where it may not: as it is
  }
  ~OwnPriority() { pthread_setschedparam(pthread_self(), policy_, &before_); }
  OwnPriority(const OwnPriority&) = delete;
  OwnPriority& operator=(const OwnPriority&) = delete;

 private:
  int policy_ = SCHED_OTHER;
  sched_param before_{};
};

Outcome measure(const Attack& attack, const std::string& transport, const std::filesystem::path& base,
                double scale) {
  const std::filesystem::path folder = base / (std::string(attack.name) + "_" + transport);
  std::filesystem::create_directories(folder);
  Victim victim(folder, base / "lab", attack.max_descriptors);
  client::Client(victim.options(transport)).rig_state();
  const double before_mb = test::resident_mb(victim.pid());
  Outcome outcome;
  {
    Running running(attack, victim, transport);
    for (const StopPath& path : stop_paths()) {
      std::optional<OwnPriority> ahead;
      if (!path.is_ordinary) ahead.emplace();
      const int count = std::max(20, static_cast<int>(kStops * path.share * scale));
      outcome.late_ms[path.name] = path.measure(victim, transport, count, kMaxTime);
    }
    outcome.inputs = running.end();
  }
  outcome.growth_mb = test::max_resident_mb(victim.pid()) - before_mb;
  // What was cut off has places for a moment more.
  const auto until = Clock::now() + kPatience;
  while (!outcome.serves && Clock::now() < until) {
    try {
      outcome.serves = client::Client(victim.options(transport)).rig_state().loop().running();
    } catch (const client::Error&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  outcome.serves = victim.stop() == 0 && outcome.serves;
  return outcome;
}

void add_figures(report::Report& report, const report::Case& conditions, const Outcome& outcome) {
  for (const auto& [path, late_ms] : outcome.late_ms) {
    report::Case of_path = conditions;
    of_path.push_back({"path", path});
    for (const double share : {0.5, 0.999, 1.0}) {
      report::Case at = of_path;
      at.push_back({"quantile", share});
      report::Figure late{
          .figure = "stop_late_ms", .conditions = at, .value = quantile(late_ms, share), .unit = "ms"};
      if (share == 0.999) late.goal = kGoalMs;
      report.add(late);
    }
    report.add({.figure = "stop_late_share",
                .conditions = of_path,
                .value = late_share(late_ms),
                .unit = "1",
                .goal = 0.001});
    report.add({.figure = "stops_tried",
                .conditions = of_path,
                .value = static_cast<double>(late_ms.size()),
                .unit = "1"});
  }
  report.add({.figure = "attack_rss_growth_mb",
              .conditions = conditions,
              .value = outcome.growth_mb,
              .unit = "MB",
              .goal = 100.0});
  report.add({.figure = "inputs_tried",
              .conditions = conditions,
              .value = static_cast<double>(outcome.inputs),
              .unit = "1"});
}

/// "1.2, 3.4, 5.6".
std::string in_short(const std::vector<double>& late_ms) {
  return fixed(quantile(late_ms, 0.5), 1) + ", " + fixed(quantile(late_ms, 0.999), 1) + ", " +
         fixed(quantile(late_ms, 1.0), 1) + " (" + std::to_string(late_ms.size()) + ")";
}

}  // namespace

std::vector<std::string> names_of_attacks() {
  std::vector<std::string> names;
  for (const Attack& attack : attacks(1.0)) names.emplace_back(attack.name);
  return names;
}

int measure_stops_under_attack(report::Report& report, const StopsUnderAttack& options) {
  const std::filesystem::path base = std::filesystem::absolute(report.folder()) / "attack";
  make_lab(base / "lab");
  std::vector<std::string> head{"attack", "transport"};
  for (const StopPath& path : stop_paths()) head.push_back(std::string(path.name) + " [ms]");
  for (const char* column : {"growth of the memory [MB]", "inputs", "serves afterwards"})
    head.emplace_back(column);
  report::MarkdownTable table{head};
  int crashes = 0;
  for (const Attack& attack : attacks(options.scale)) {
    const bool is_chosen =
        options.only.empty() || std::count(options.only.begin(), options.only.end(), attack.name) > 0;
    for (const std::string transport : kTransports) {
      if (!is_chosen) continue;
      report::Report::note(std::string(attack.name) + " over " + transport + " …");
      const report::Case conditions{{"attack", attack.name}, {"transport", transport}};
      std::vector<std::string> row{attack.name, transport};
      try {
        const Outcome outcome = measure(attack, transport, base, options.scale);
        crashes += outcome.serves ? 0 : 1;
        add_figures(report, conditions, outcome);
        for (const StopPath& path : stop_paths()) row.push_back(in_short(outcome.late_ms.at(path.name)));
        row.push_back(fixed(outcome.growth_mb, 0));
        row.push_back(std::to_string(outcome.inputs));
        row.emplace_back(outcome.serves ? "yes" : "no");
      } catch (const std::exception& error) {
        ++crashes;
        report.add(
            {.figure = "stop_late_ms", .conditions = conditions, .unit = "ms", .failed = error.what()});
        row.resize(head.size() - 1, report::kNoNumber);
        row.emplace_back(error.what());
      }
      table.add_row(row);
    }
  }
  report.add_table(
      "stops", "How late a stop comes under attack", table,
      "Median, 99.9 % and worst, and how many stops were tried. The attack uses the same transport and "
      "the same processors; stop_port and signal are called by a thread that runs ahead of it.");
  return crashes;
}

}  // namespace hapticd::bench
