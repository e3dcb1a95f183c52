#include "tests/measure/bench/attack/stop_under_attack.h"

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
#include "client/cpp/stop/ahead.h"
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

/// How late each stop came, without the time in which the thread that stops waited for a processor.
std::vector<double> without_own_wait(const MeasuredStops& stops) {
  std::vector<double> rest_ms = stops.late_ms;
  std::transform(rest_ms.begin(), rest_ms.end(), stops.own_wait_ms.begin(), rest_ms.begin(),
                 [](double late_ms, double wait_ms) { return std::max(0.0, late_ms - wait_ms); });
  return rest_ms;
}

struct Outcome {
  std::map<std::string, MeasuredStops> stops;  ///< by the name of the path
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
      std::optional<client::Ahead> ahead;
      if (!path.is_ordinary) ahead.emplace();
      const int count = std::max(20, static_cast<int>(kStops * path.share * scale));
      outcome.stops[path.name] = path.measure(victim, transport, count, kMaxTime);
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
  for (const auto& [path, stops] : outcome.stops) {
    const std::vector<double>& late_ms = stops.late_ms;
    report::Case of_path = conditions;
    of_path.push_back({"path", path});
    for (const double share : {0.5, 0.999, 1.0}) {
      report::Case at = of_path;
      at.push_back({"quantile", share});
      report::Figure late{
          .figure = "stop_late_ms", .conditions = at, .value = quantile(late_ms, share), .unit = "ms"};
      if (share == 0.999) late.goal = kGoalMs;
      report.add(late);
      if (stops.own_wait_ms.empty()) continue;
      report.add({.figure = "stop_late_without_own_wait_ms",
                  .conditions = at,
                  .value = quantile(without_own_wait(stops), share),
                  .unit = "ms"});
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

/// "1.2, 3.4, 5.6 (1000); 2.1".
std::string in_short(const MeasuredStops& stops) {
  std::string text;
  for (const double share : {0.5, 0.999, 1.0})
    text += (text.empty() ? "" : ", ") + fixed(quantile(stops.late_ms, share), 1);
  text += " (" + std::to_string(stops.late_ms.size()) + ")";
  if (!stops.own_wait_ms.empty()) text += "; " + fixed(quantile(without_own_wait(stops), 0.999), 1);
  return text;
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
        for (const StopPath& path : stop_paths()) row.push_back(in_short(outcome.stops.at(path.name)));
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
  report.add_table("stops", "How late a stop comes under attack", table,
                   "Median, 99.9 % and worst, and how many stops were tried; the 99.9 % without the time in "
                   "which the thread that "
                   "stops waited for a processor. The attack uses the same transport and "
                   "the same processors; stop_port and signal are called by a thread that runs ahead of it.");
  return crashes;
}

}  // namespace hapticd::bench
