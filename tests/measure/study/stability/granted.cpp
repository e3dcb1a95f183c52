// Whether what is granted is stable, whatever the device's structure, the sensor, the encoders and the clock
// do.

#include "tests/measure/study/stability/granted.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/stability/scaled_object.h"

namespace hapticd::study {

using report::fixed;

namespace {

/// An object that bears hardly anything of what is felt of a target that is twenty times as stiff.
bool is_very_soft(const GrantedCase& c) {
  return c.object_n_per_mm < 0.1;
}

}  // namespace

StabilityTrial granted_trial(const GrantedCase& c) {
  StabilityTrial trial = tap_trial(c.device, scaled_object("rubber_eraser", c.object_n_per_mm));
  sim::DeviceModel& device = *trial.rig.custom_device;
  trial.scene.structural_stiffness_n_per_mm = device.structural_stiffness_n_per_mm;
  trial.scene.max_target_stiffness_n_per_mm = granted_n_per_mm(trial);
  device.structural_mode_hz = c.mode_hz * std::sqrt(c.structure_scale);  // the masses are what they are
  device.structural_stiffness_n_per_mm *= c.structure_scale;
  auto& conditions = trial.rig.condition_values;
  if (c.delay == "sensor") conditions["sensor_delay_ms"] = 2.0;
  if (c.delay == "encoders") conditions["encoder_delay_ms"] = 2.0;
  if (c.is_late) {
    conditions["late_tick_share"] = 0.2;
    conditions["late_tick_ms"] = 1.0;
  }
  trial.knock_n = 1.5;
  return trial;
}

std::vector<GrantedCase> granted_cases(bool quick) {
  std::vector<GrantedCase> cases;
  const std::vector<double> objects =
      quick ? std::vector<double>{0.05, 2.3} : std::vector<double>{0.05, 0.3, 1.0, 2.3, 10.0, 100.0, 1000.0};
  for (const std::string device : {"phantom_1_0", "phantom_1_5_high_force"}) {
    const double lowest_hz = device == "phantom_1_0" ? 70.0 : 60.0;
    for (const double mode_hz : {lowest_hz, 100.0, 140.0, 220.0}) {
      for (const double k : objects) {
        for (const std::string delay : {"none", "sensor", "encoders"}) {
          for (const bool is_late : {false, true}) {
            if (quick && (mode_hz > 100.0 || is_late)) continue;
            cases.push_back({device, k, mode_hz, delay, is_late, 1.0});
          }
        }
        for (const double scale : {0.7, 1.3}) {
          if (mode_hz <= 100.0) cases.push_back({device, k, mode_hz, "none", false, scale});
        }
      }
    }
  }
  return cases;
}

void run_granted_stability(StudyContext& context) {
  constexpr std::array<double, 4> kShares{0.4, 0.6, 0.8, 1.0};  // of the largest target that is granted
  const std::vector<GrantedCase> all = granted_cases(context.quick);
  // Three numbers a case: targets tried, unstable ones, their largest swing.
  const auto cells = context.cells.values("granted", all.size(), [&](std::size_t i) {
    const StabilityTrial trial = granted_trial(all[i]);
    std::vector<double> values{0.0, 0.0, 0.0};
    for (const double share : kShares) {
      const double target = share * trial.scene.max_target_stiffness_n_per_mm;
      if (target < softest_feasible_n_per_mm(trial)) continue;
      const TrialOutcome outcome = run_trial(trial, target);
      ++values[0];
      if (is_stable(outcome.verdict)) continue;
      ++values[1];
      values[2] = std::max(values[2], outcome.swing_mm);
    }
    return values;
  });
  if (!cells) return;
  report::MarkdownTable table({"device", "objects N/mm", "mode Hz", "2 ms late", "ticks late", "structure",
                               "tried", "unstable", "largest swing mm", "on objects of N/mm"});
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto same = [&](const GrantedCase& c) {
      return c.device == all[i].device && c.mode_hz == all[i].mode_hz && c.delay == all[i].delay &&
             c.is_late == all[i].is_late && c.structure_scale == all[i].structure_scale &&
             is_very_soft(c) == is_very_soft(all[i]);
    };
    if (std::any_of(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(i), same)) continue;
    std::array<double, 3> sum{};
    std::string objects;
    for (std::size_t j = i; j < all.size(); ++j) {
      if (!same(all[j])) continue;
      const std::vector<double>& values = (*cells)[j];
      sum = {sum[0] + values[0], sum[1] + values[1], std::max(sum[2], values[2])};
      if (values[1] > 0.0)
        objects += (objects.empty() ? "" : ", ") + report::significant(all[j].object_n_per_mm, 2);
    }
    report::Figure figure{"granted_unstable_share",
                          {{"device", all[i].device},
                           {"mode_hz", all[i].mode_hz},
                           {"delay", all[i].delay},
                           {"late", all[i].is_late ? "yes" : "no"},
                           {"structure", all[i].structure_scale},
                           {"objects", is_very_soft(all[i]) ? "0.05" : "0.3 … 1000"}}};
    figure.goal = 0.0;
    if (sum[0] > 0.0) {
      figure.value = sum[1] / sum[0];
    } else {
      figure.failed = "no granted target is feasible";
    }
    context.report.add(figure);
    table.add_row({all[i].device, is_very_soft(all[i]) ? "0.05" : "0.3 … 1000", fixed(all[i].mode_hz, 0),
                   all[i].delay, all[i].is_late ? "a fifth, by 1 ms" : "no", fixed(all[i].structure_scale, 1),
                   fixed(sum[0], 0), fixed(sum[1], 0), fixed(sum[2], 2), objects});
  }
  context.report.add_table(
      "granted_stability", "Granted targets that swing", table,
      std::string(
          "tap_1d as shipped at 0.4 … 1 of the largest target it grants, where (3.8) leaves it feasible; "
          "objects of 0.05 … 1000 N/mm; knocks of 1.5 N. Granted as if the mode were known and high: up to 1 "
          "N/mm. Structure: what it is over what the rig states. "
          "Objects: those with an unstable target. ") +
          kTrialInWords);
}

}  // namespace hapticd::study
