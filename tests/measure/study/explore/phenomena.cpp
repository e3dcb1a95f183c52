#include <algorithm>
#include <cmath>
#include <string>

#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/shadow.h"

namespace hapticd::study {

namespace {

/// Noise of an estimate held at a force: standard deviation about its own slow course.
struct Noise {
  double dissertation_mm = 0.0;
  double ours_mm = 0.0;
};

Noise noise_at(const std::string& object, double force_n) {
  VirtualRun run = unrendered(explore_rig("phantom_1_5_high_force", object, "ball_bearing"));
  sim::HandProgram hand = pressing(force_n);
  run.set_hand(hand);
  Shadow theirs(run.info(), dissertation_scene(rt::Tip::kBallBearing), identified(object).dissertation);
  Shadow ours(run.info(), explore_scene(rt::Tip::kBallBearing), identified(object).model);
  double sums[2] = {0, 0}, squares[2] = {0, 0}, before[2] = {0, 0};
  int count = 0;
  while (run.time_s() < 7.0) {
    run.step();
    theirs.watch(run.sample());
    ours.watch(run.sample());
    const double values[2] = {theirs.record().displacement_mm, ours.record().displacement_mm};
    for (int i = 0; i < 2; ++i) {
      const double change = values[i] - before[i];
      before[i] = values[i];
      if (run.time_s() < 4.0) continue;
      sums[i] += change;
      squares[i] += change * change;
    }
    if (run.time_s() >= 4.0) ++count;
  }
  const auto deviation = [&](int i) {
    const double mean = sums[i] / count;
    return std::sqrt(std::max(0.0, squares[i] / count - mean * mean));
  };
  return {deviation(0), deviation(1)};
}

/// x̂/x of the dissertation's law when the object is pressed slowly to a depth.
double ratio_at_depth(const std::string& object, double depth_mm) {
  VirtualRun run = unrendered(explore_rig("phantom_1_5_high_force", object, "ball_bearing"));
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kPress;
  hand.depth_mm = depth_mm;
  hand.approach_mm_per_s = 15.0;
  hand.hold_s = -1.0;
  run.set_hand(hand);
  Shadow shadow(run.info(), dissertation_scene(rt::Tip::kBallBearing), identified(object).dissertation);
  while (run.time_s() < 20.0) {
    run.step();
    shadow.watch(run.sample());
    if (run.truth().displacement_mm > 0.98 * depth_mm) {
      return shadow.record().displacement_mm / run.truth().displacement_mm;
    }
  }
  return std::nan("");
}

}  // namespace

void run_phenomena(StudyContext& context) {
  using report::fixed;
  report::SvgPlot plot;
  plot.title = "Jitter of the displacement from tick to tick, sponge held";
  plot.x = {"force", "N", true};
  plot.y = {"standard deviation of the change in a tick", "um"};
  plot.y.minimum = 0.0;
  report::PlotSeries theirs{"dissertation"}, ours{"default"};
  theirs.style = ours.style = report::PlotSeries::Style::kLinePoints;
  report::MarkdownTable jitter({"force N", "dissertation µm/tick", "default µm/tick"});
  for (const double force_n : {0.1, 0.2, 0.4, 0.8, 1.5, 3.0}) {
    const Noise noise = noise_at("sponge_cut", force_n);
    theirs.add(force_n, 1e3 * noise.dissertation_mm);
    ours.add(force_n, 1e3 * noise.ours_mm);
    jitter.add_row({fixed(force_n, 1), fixed(1e3 * noise.dissertation_mm, 2), fixed(1e3 * noise.ours_mm, 2)});
    for (const bool is_ours : {false, true}) {
      report::Figure figure{"displacement_jitter_mm",
                            {{"object", "sponge_cut"},
                             {"force_n", force_n},
                             {"pipeline", is_ours ? "default" : "dissertation"}}};
      figure.unit = "mm";
      figure.value = is_ours ? noise.ours_mm : noise.dissertation_mm;
      figure.source = "D§4.6.2: grows near zero displacement";
      context.report.add(figure);
    }
  }
  plot.series = {theirs, ours};
  context.report.add_table("phenomena_jitter", "Noise near zero displacement", jitter,
                           "Sponge, pressed and held, nothing rendered.");
  context.report.add_plot("phenomena_jitter", plot);

  report::MarkdownTable bias({"depth mm", "x̂/x - 1 %", "rendered would be", "D§4.7"});
  struct Case {
    double depth_mm;
    const char* reported;
    double sign;
  };
  for (const Case& c : {Case{10.0, "", 0.0},
                        {17.5, "0.8 N/mm: PSE below", -1.0},
                        {22.0, "", 0.0},
                        {28.0, "0.3 N/mm: PSE above", 1.0}}) {
    const double error = ratio_at_depth("sponge_cut", c.depth_mm) - 1.0;
    report::Figure figure{"hunt_crossley_bias", {{"object", "sponge_cut"}, {"depth_mm", c.depth_mm}}};
    figure.value = error;
    if (c.sign != 0.0) figure.reference = c.sign * 0.1;
    figure.source = "D§4.7.3, Fig. 4.20-4.21: sign; densification near 25 mm";
    context.report.add(figure);
    bias.add_row(
        {fixed(c.depth_mm, 1), fixed(100.0 * error, 1), error < 0.0 ? "too soft" : "too hard", c.reported});
  }
  context.report.add_table(
      "phenomena_bias", "Bias of the Hunt-Crossley law on the densifying sponge", bias,
      "Pressed at 15 mm/s to a depth; 14 N at 0.8 N/mm are 17.5 mm, at 0.3 N/mm more than 25 mm.");
}

}  // namespace hapticd::study
