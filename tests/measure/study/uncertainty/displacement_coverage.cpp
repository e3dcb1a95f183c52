// How often the displacement lies as near to the truth as its standard deviation in the telemetry says.

#include "tests/measure/study/uncertainty/displacement_coverage.h"

#include <algorithm>
#include <string>
#include <vector>

#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/shadow.h"

namespace hapticd::study {

namespace {

constexpr double kMinMm = 0.2;        // less is the surface's roughness
constexpr double kLettingGoMm = 0.3;  // off the deepest since the tip slid last

void count_strokes(const sim::SimulationConfig& rig, const sim::HandProgram& hand, rt::Tip tip,
                   const rt::ObjectModel& model, StrokeCoverage& counts) {
  VirtualRun run = unrendered(rig);
  Shadow shadow(run.info(), explore_scene(tip), model);
  run.set_hand(hand);
  const double end_s = judged_strokes_end_s(hand);
  double deepest_mm = 0.0;
  while (run.time_s() < end_s) {
    run.step();
    shadow.watch(run.sample());
    const hal::TruthSample& truth = run.truth();
    const rt::TickRecord& record = shadow.record();
    if (!truth.in_contact) deepest_mm = 0.0;
    deepest_mm = std::max(deepest_mm, truth.displacement_mm);
    if (!truth.in_contact || !record.in_contact || truth.displacement_mm < kMinMm) continue;
    const bool leaves = truth.displacement_mm < (1.0 - kLettingGoMm) * deepest_mm;
    (leaves ? counts.letting_go : counts.pressing)
        .add(record.displacement_mm - truth.displacement_mm, record.displacement_deviation_mm);
  }
}

}  // namespace

StrokeCoverage stroke_coverage(const std::string& object, rt::Tip tip, const std::vector<double>& forces_n,
                               const std::vector<double>& speeds_mm_per_s) {
  StrokeCoverage counts;
  std::uint64_t seed = 500;  // other strokes than those by which the deviation's constants were chosen
  for (const double force_n : forces_n) {
    for (const double speed : speeds_mm_per_s) {
      sim::SimulationConfig rig =
          explore_rig("phantom_1_5_high_force", object, tip == rt::Tip::kRod ? "rod" : "ball_bearing");
      rig.seed = ++seed;
      count_strokes(rig, judged_strokes(force_n, speed), tip, identified(object).model, counts);
    }
  }
  return counts;
}

void run_displacement_coverage(StudyContext& context) {
  report::MarkdownTable table(
      {"object", "tip", "phase", "within 1 %", "within 2 %", "rms of error / deviation"});
  const std::vector<double> forces_n =
      context.quick ? std::vector<double>{4.0} : std::vector<double>{2, 4, 6};
  const std::vector<double> speeds =
      context.quick ? std::vector<double>{100.0} : std::vector<double>{50, 100, 200};
  StrokeCoverage all;
  for (const bool rod : {true, false}) {
    for (const std::string& object : explored_objects()) {
      const StrokeCoverage counts =
          stroke_coverage(object, rod ? rt::Tip::kRod : rt::Tip::kBallBearing, forces_n, speeds);
      const auto row = [&](const char* phase, const Coverage& of) {
        table.add_row(
            {object, rod ? "rod" : "bearing", phase, of.text(1.0), of.text(2.0), report::fixed(of.rms(), 2)});
      };
      row("pressing and stroking", counts.pressing);
      row("letting go", counts.letting_go);
      all.pressing.add(counts.pressing);
      all.letting_go.add(counts.letting_go);
    }
  }
  all.pressing.report(context.report, "displacement");
  all.letting_go.report(context.report, "displacement, letting go");
  context.report.add_table(
      "displacement_coverage", "Displacement: how often its error is within its deviation", table,
      "Strokes back and forth with 2 … 6 N and 50 … 200 mm/s, models that the service identified "
      "on other presses. A deviation that is true has 68 % within one, 95 % within two. Letting "
      "go: less deep than seven tenths of the deepest so far.");
}

}  // namespace hapticd::study
