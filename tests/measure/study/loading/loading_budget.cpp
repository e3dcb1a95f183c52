#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/measure/study/loading/loading_study.h"

namespace hapticd::study {

namespace {

using report::fixed;

constexpr double kRateNPerS = 10.0;

/// Something that makes an error, and how to take it out of the rig or the scene.
struct Cause {
  const char* name;
  const char* in_words;
  std::function<void(LoadingTrial&)> switch_off;
  bool with_others = true;  ///< taken out if all are at once; a light device would swing by itself
};

/// A device without mass would have no structural mode: a fiftieth of it, as stiff as before.
void make_light(LoadingTrial& trial) {
  constexpr double kShare = 0.02;
  sim::DeviceModel& device = *trial.rig.custom_device;
  device.apparent_mass_kg *= kShare;
  device.structural_mode_hz /= std::sqrt(kShare);
  device.sensor_mass_kg *= kShare;
  trial.rig.tool_mass_g *= kShare;
  trial.scene.tool_mass_g *= kShare;
}

void act_at_once(LoadingTrial& trial) {
  trial.rig.custom_device->command_latency_s = 0.0;
  trial.rig.custom_device->amplifier_pole_hz = 3000.0;
}

void remove_friction(LoadingTrial& trial) {
  trial.rig.custom_device->coulomb_friction_n = 0.0;
  trial.rig.custom_device->viscous_friction_n_s_per_mm = 0.0;
}

void refine_encoders(LoadingTrial& trial) {
  trial.rig.custom_device->encoder_resolution_mm = 1e-4;
}

void stiffen(LoadingTrial& trial) {
  // As much stiffer as keeps the mode's mass.
  constexpr double kTimes = 25.0;
  trial.rig.custom_device->structural_stiffness_n_per_mm *= kTimes;
  trial.rig.custom_device->structural_mode_hz *= std::sqrt(kTimes);
}

void believe_at_once(LoadingTrial& trial) {
  trial.scene.contact.evidence.required = false;
}

const std::vector<Cause>& causes() {
  static const std::vector<Cause> all{
      {"evidence", "force is rendered from the declared contact on", believe_at_once},
      {"actuation", "no latency, amplifier pole at 3 kHz", act_at_once},
      {"controller", "the desired force is the command",
       [](LoadingTrial& trial) { trial.scene.controller.law = rt::ControlLaw::kOpenLoop; }},
      {"friction", "no dry or viscous friction in the device", remove_friction},
      {"inertia", "device, sensor and tool of a fiftieth of their mass", make_light, false},
      {"structure", "25 times as stiff", stiffen, false},
      {"encoders", "0.1 µm", refine_encoders},
  };
  return all;
}

}  // namespace

void run_loading_budget(StudyContext& context) {
  std::vector<std::string> headers{"device", "object", "dims", "target N/mm", "compensation", "error %"};
  for (const Cause& cause : causes()) headers.emplace_back(cause.name);
  headers.emplace_back("left");
  report::MarkdownTable table(headers);
  std::vector<std::string> mean_headers{"device", "dims", "compensation", "error %"};
  for (const Cause& cause : causes()) mean_headers.emplace_back(cause.name);
  mean_headers.emplace_back("left");
  report::MarkdownTable means(mean_headers);

  struct Sums {
    std::vector<double> sum;
    std::vector<int> count;
  };
  std::map<std::string, Sums> sums;
  std::vector<std::string> order;
  for (const LoadingCase& c : loading_cases(context.quick)) {
    for (const bool compensated : {true, false}) {
      LoadingTrial trial = c.trial(kRateNPerS);
      if (!compensated) leave_uncompensated(trial.scene);
      const LoadingOutcome all = press_as_feasible(trial);
      const std::string compensation = compensated ? "default" : "none";
      std::vector<std::string> row{
          c.device,         c.object,
          fixed(c.dims, 0), fixed(c.target_n_per_mm, 1),
          compensation,     all.failed.empty() ? fixed(100.0 * all.error_mean, 1) : all.failed};
      const std::string key = c.device + "|" + fixed(c.dims, 0) + "|" + compensation;
      if (sums.find(key) == sums.end()) {
        order.push_back(key);
        sums[key] = {std::vector<double>(causes().size() + 2), std::vector<int>(causes().size() + 2)};
      }
      const auto count = [&](std::size_t column, double value) {
        sums[key].sum[column] += value;
        ++sums[key].count[column];
      };
      if (all.failed.empty()) count(0, all.error_mean);
      LoadingTrial nothing = trial;
      std::size_t column = 0;
      for (const Cause& cause : causes()) {
        ++column;
        LoadingTrial without = trial;
        cause.switch_off(without);
        if (cause.with_others) cause.switch_off(nothing);
        const LoadingOutcome rest = press(without);
        const std::string failed = all.failed.empty() ? rest.failed : all.failed;
        report::Figure figure{"loading_error_part",
                              {{"device", c.device},
                               {"object", c.object},
                               {"target", c.target_n_per_mm},
                               {"rate_n_per_s", kRateNPerS},
                               {"dims", c.dims},
                               {"compensation", compensation},
                               {"cause", cause.name}}};
        figure.failed = failed;
        if (failed.empty()) {
          figure.value = all.error_mean - rest.error_mean;
          count(column, *figure.value);
        }
        context.report.add(figure);
        row.push_back(figure.value ? fixed(100.0 * *figure.value, 1) : std::string(report::kNoNumber));
      }
      const LoadingOutcome left = press(nothing);
      if (left.failed.empty()) count(column + 1, left.error_mean);
      row.push_back(left.failed.empty() ? fixed(100.0 * left.error_mean, 1) : std::string(report::kNoNumber));
      table.add_row(row);
    }
  }
  for (const std::string& key : order) {
    const std::size_t first = key.find('|');
    const std::size_t second = key.find('|', first + 1);
    std::vector<std::string> row{key.substr(0, first), key.substr(first + 1, second - first - 1),
                                 key.substr(second + 1)};
    for (std::size_t i = 0; i < sums[key].sum.size(); ++i) {
      row.push_back(sums[key].count[i] > 0 ? fixed(100.0 * sums[key].sum[i] / sums[key].count[i], 1)
                                           : std::string(report::kNoNumber));
    }
    means.add_row(row);
  }
  std::string remark =
      "At 10 N/s. Each part is the mean error less that of the same press without the cause, in "
      "percent of the target; negative where a cause hides another's error. ";
  for (const Cause& cause : causes()) remark += std::string(cause.name) + ": " + cause.in_words + "; ";
  remark += "left: with all of them but inertia and structure taken out at once.";
  context.report.add_table("loading_budget", "What makes the error while pressing", table, remark);
  context.report.add_table("loading_budget_means", "The same, mean of the objects and targets", means);
}

}  // namespace hapticd::study
