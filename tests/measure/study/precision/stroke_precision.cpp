#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "rt/baseline/published_direction.h"
#include "rt/deformation/displacement.h"
#include "rt/deformation/tracked_direction.h"
#include "rt/signal/vector.h"
#include "tests/measure/report/quantile.h"
#include "tests/measure/report/run_time.h"
#include "tests/measure/report/work_precision.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/precision/estimation_stages.h"
#include "tests/measure/study/precision/stroke_log.h"

namespace hapticd::study {

namespace {

using report::fixed;
using report::quantile;

constexpr double kRateHz = 1000.0;

/// What a stage is composed for.
struct Conditions {
  rt::FrictionLaw law;
  rt::FrictionParameters friction;
};

Conditions conditions_of(const std::string& object) {
  return {rt::FrictionLaw::kDahl, *identified(object).model.rod_friction};
}

// --- direction ---

/// A way to the normal, replayed on what the default pipeline handed to its own.
struct DirectionMethod {
  std::string name;
  bool is_default = false;
  bool is_published = false;  ///< but for its filter
  /// The normal in each tick; zero out of contact.
  std::function<std::vector<hal::Vector3>(const StrokeLog&, const Conditions&)> replay;
  std::function<double(const StrokeLog&, const Conditions&, double seconds)> run_time_ns;
};

/// `make(Conditions)` gives an estimator.
template <class Make>
DirectionMethod direction_method(const std::string& name, Make make, bool is_default = false) {
  const auto step = [](auto& estimator, const StrokeTick& tick) {
    if (tick.begins) {
      estimator.begin(tick.reaction_n);
    } else {
      estimator.update(tick.reaction_n, tick.step_mm, tick.velocity_mm_per_s);
    }
  };
  return {name, is_default, name.starts_with("published"),
          [=](const StrokeLog& log, const Conditions& conditions) {
            auto estimator = make(conditions);
            std::vector<hal::Vector3> normals;
            for (const StrokeTick& tick : log.ticks) {
              if (tick.in_contact) step(estimator, tick);
              normals.push_back(tick.in_contact ? estimator.normal() : hal::Vector3{});
            }
            return normals;
          },
          [=](const StrokeLog& log, const Conditions& conditions, double seconds) {
            std::vector<StrokeTick> touching;
            for (const StrokeTick& tick : log.ticks) {
              if (tick.in_contact) touching.push_back(tick);
            }
            return report::run_time_ns(
                touching.size(),
                [&] {
                  auto estimator = make(conditions);
                  double sum = 0.0;
                  for (const StrokeTick& tick : touching) {
                    step(estimator, tick);
                    sum += estimator.normal().z;
                  }
                  return sum;
                },
                seconds);
          }};
}

/// The direction of the reaction as it is, friction and all: what there is without any friction model.
class ReactionDirection {
 public:
  void begin(const hal::Vector3& reaction_n) noexcept { normal_ = rt::direction_or(reaction_n, normal_); }
  void update(const hal::Vector3& reaction_n, const hal::Vector3&, const hal::Vector3&) noexcept {
    begin(reaction_n);
  }
  const hal::Vector3& normal() const noexcept { return normal_; }

 private:
  hal::Vector3 normal_{0.0, 0.0, 1.0};
};

std::vector<DirectionMethod> direction_methods() {
  const double noise_n = rt::ExploreParameters{}.force_noise_n;
  return {
      direction_method(
          "tracked", [=](const Conditions& c) { return rt::TrackedDirection(c.friction, noise_n, kRateHz); },
          true),
      direction_method(
          "published, 70 Hz",
          [](const Conditions& c) { return rt::PublishedDirection(c.law, c.friction, kRateHz); }),
      direction_method("reaction as it is", [](const Conditions&) { return ReactionDirection(); }),
  };
}

struct DirectionErrors {
  std::vector<double> sliding_deg;
  std::vector<double> all_deg;  ///< turns and pressing as well
};

void judge_direction(const StrokeLog& log, const std::vector<hal::Vector3>& normals,
                     DirectionErrors& errors) {
  for (std::size_t i = 0; i < log.ticks.size(); ++i) {
    const StrokeTick& tick = log.ticks[i];
    if (!log.counts(i) || !tick.in_contact) continue;
    const double cosine = std::clamp(dot(normals[i], tick.true_normal), -1.0, 1.0);
    const double angle_deg = std::acos(cosine) * 180.0 / std::numbers::pi;
    errors.all_deg.push_back(angle_deg);
    if (tick.sliding_mm_per_s > kSlidingMmPerS) errors.sliding_deg.push_back(angle_deg);
  }
}

// --- displacement ---

/// A whole pipeline, and its displacement stage alone for the time it takes.
struct DisplacementMethod {
  std::string name;
  rt::DisplacementEstimator way;
  rt::ContactLawKind law;
  bool as_published = false;  ///< the dissertation's pipeline and model, whole
  bool is_default = false;
};

const std::vector<DisplacementMethod>& displacement_methods() {
  using Way = rt::DisplacementEstimator;
  using Law = rt::ContactLawKind;
  static const std::vector<DisplacementMethod> methods{
      {"fused, creep law", Way::kFused, Law::kCreep, false, true},
      {"fused, Hunt-Crossley", Way::kFused, Law::kHuntCrossley},
      {"inverse, creep law", Way::kInverse, Law::kCreep},
      {"inverse, Hunt-Crossley", Way::kInverse, Law::kHuntCrossley},
      {"recursive (4.21)", Way::kRecursive, Law::kCreep},
      {"dissertation's pipeline", Way::kInverse, Law::kHuntCrossley, true}};
  return methods;
}

std::vector<Watching> watching(const std::string& object) {
  constexpr rt::Tip tip = rt::Tip::kRod;
  std::vector<Watching> all;
  for (const DisplacementMethod& method : displacement_methods()) {
    const IdentificationResult& models = identified(object);
    if (method.as_published) {
      all.push_back({dissertation_scene(tip), &models.dissertation});
      continue;
    }
    all.push_back({explore_scene(tip), &models.model});
    all.back().scene.explore.displacement = method.way;
    all.back().scene.explore.law = method.law;
  }
  return all;
}

rt::Displacement stage_of(const DisplacementMethod& method, const IdentificationResult& models) {
  const rt::ObjectModel& model = method.as_published ? models.dissertation : models.model;
  if (method.way == rt::DisplacementEstimator::kRecursive) {
    return {rt::RecursiveDisplacement{}, std::monostate{}};
  }
  const bool creeps = method.law == rt::ContactLawKind::kCreep;
  const rt::ContactLaw law = creeps ? rt::ContactLaw(rt::CreepLaw(model.creep->parameters, kRateHz))
                                    : rt::ContactLaw(model.hunt_crossley->parameters);
  if (method.way == rt::DisplacementEstimator::kInverse) {
    return {rt::InverseDisplacement{rt::ButterworthLowPass(rt::InverseDisplacement::kCutoffHz, kRateHz)},
            law};
  }
  const double error = creeps ? model.creep->relative_error : model.hunt_crossley->relative_error;
  return {rt::FusedDisplacement(error, rt::ExploreParameters{}.force_noise_n, kRateHz), law};
}

constexpr rt::TickInterval kEvenTick{1.0 / kRateHz, 1.0, 1.0, false};

/// The stage alone, on the normals and forces of the default pipeline.
double displacement_run_time_ns(const DisplacementMethod& method, const IdentificationResult& models,
                                const StrokeLog& log, double seconds) {
  std::vector<StrokeTick> touching;
  for (const StrokeTick& tick : log.ticks) {
    if (tick.in_contact) touching.push_back(tick);
  }
  return report::run_time_ns(
      touching.size(),
      [&] {
        rt::Displacement stage = stage_of(method, models);
        double sum = 0.0;
        hal::Vector3 normal_before;
        for (const StrokeTick& tick : touching) {
          if (tick.begins) {
            stage.begin(tick.tip_mm, tick.tip_mm, tick.normal, 0.01);
          } else {
            stage.update(tick.tip_mm, -dot(tick.step_mm, normal_before),
                         rt::across(tick.step_mm, normal_before), tick.normal, tick.normal_n,
                         tick.rate_mm_per_s, kEvenTick);
          }
          normal_before = tick.normal;
          sum += stage.displacement_mm();
        }
        return sum;
      },
      seconds);
}

constexpr double kMinMm = 0.2;  // below it a ratio of displacements says nothing

void judge_displacement(const StrokeLog& log, std::size_t method, std::vector<double>& relative) {
  for (std::size_t i = 0; i < log.ticks.size(); ++i) {
    const StrokeTick& tick = log.ticks[i];
    if (!log.counts(i) || tick.displacement_mm < kMinMm || std::isnan(tick.estimate_mm[method])) continue;
    relative.push_back(std::abs(tick.estimate_mm[method] / tick.displacement_mm - 1.0));
  }
}

// --- both ---

/// Errors of all methods on one object.
struct Judged {
  std::vector<DirectionErrors> direction;
  std::vector<std::vector<double>> displacement;
};

struct Timed {
  StrokeLog log;
  std::string object;
};

struct Data {
  std::vector<std::string> objects;
  std::map<std::string, Judged> judged;  ///< by object
  Timed timed;                           ///< the first strokes
  std::size_t strokes = 0;
};

Data judge_all(const std::vector<DirectionMethod>& directions, bool quick) {
  Data data;
  for (const std::string& object : explored_objects()) {
    if (!quick || data.objects.empty()) data.objects.push_back(object);
  }
  const std::vector<double> forces_n = quick ? std::vector<double>{4.0} : std::vector<double>{2, 4, 6};
  const std::vector<double> speeds =
      quick ? std::vector<double>{150.0} : std::vector<double>{50, 100, 150, 200};
  for (const std::string& object : data.objects) {
    const Conditions conditions = conditions_of(object);
    const std::vector<Watching> pipelines = watching(object);
    Judged& judged = data.judged[object];
    judged.direction.resize(directions.size());
    judged.displacement.resize(pipelines.size());
    std::uint64_t seed = 1;
    for (const double force_n : forces_n) {
      for (const double speed : speeds) {
        StrokeLog log = log_strokes(object, "rod", force_n, speed, ++seed, pipelines);
        for (std::size_t m = 0; m < directions.size(); ++m) {
          judge_direction(log, directions[m].replay(log, conditions), judged.direction[m]);
        }
        for (std::size_t m = 0; m < pipelines.size(); ++m) {
          judge_displacement(log, m, judged.displacement[m]);
        }
        ++data.strokes;
        if (data.timed.object.empty()) data.timed = {std::move(log), object};
      }
    }
  }
  return data;
}

/// Mean over the objects of a number of each.
template <class Number>
double over_objects(const Data& data, Number number) {
  double sum = 0.0;
  for (const std::string& object : data.objects) sum += number(data.judged.at(object));
  return sum / static_cast<double>(data.objects.size());
}

std::string strokes_remark(const Data& data) {
  return std::to_string(data.strokes) +
         " recordings of strokes back and forth over 50 mm with the rod on the objects of D§4 (2-6 N, 50-200 "
         "mm/s, "
         "tool swaying by 10°; a seed each), high-force device, nothing rendered; models identified by "
         "palpation of the same simulated objects. ";
}

void show_directions(StudyContext& context, const std::vector<DirectionMethod>& methods, const Data& data,
                     double seconds) {
  report::WorkPrecision stage;
  stage.stage = "direction";
  stage.error_name = "direction error while sliding, 95th percentile";
  stage.error_unit = "deg";
  stage.remark =
      strokes_remark(data) +
      "Angle to the true normal while the tip slides faster than 10 mm/s, 95 % of it is below; mean "
      "over the objects. All replay the same reactions and encoder steps; run time of the stage alone.";
  stage.justification = "it is kept for what happens at the turns of a stroke, see the table.";
  report::MarkdownTable table({"method", "sliding p50 °", "sliding p95 °", "with turns p95 °"});
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const auto p = [&](double share, std::vector<double> DirectionErrors::*which) {
      return over_objects(data, [&](const Judged& j) { return quantile(j.direction[m].*which, share); });
    };
    const double run_time_ns =
        methods[m].run_time_ns(data.timed.log, conditions_of(data.timed.object), seconds);
    const double error_deg = p(0.95, &DirectionErrors::sliding_deg);
    stage.methods.push_back({methods[m].name, error_deg, run_time_ns, methods[m].is_default, {}});
    table.add_row({methods[m].name + (methods[m].is_default ? " (default)" : ""),
                   fixed(p(0.5, &DirectionErrors::sliding_deg), 1), fixed(error_deg, 1),
                   fixed(p(0.95, &DirectionErrors::all_deg), 1)});
  }
  add_stage(context.report, stage);
  context.report.add_table("direction_tips", "Direction error with a rod", table,
                           "Mean over the objects. With turns: all of pressing, turning and stroking. The "
                           "just noticeable difference of force direction is 18.4° (D§4.4.3).");
  const auto rod_p95 = [&](std::size_t m, std::vector<double> DirectionErrors::*which) {
    return fixed(over_objects(data, [&](const Judged& j) { return quantile(j.direction[m].*which, 0.95); }),
                 1);
  };
  std::string sliding, turning;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    if (!methods[m].is_default && !methods[m].is_published) continue;
    const std::string between = m == 0 ? "" : ", ";
    sliding += between + rod_p95(m, &DirectionErrors::sliding_deg) + "° (" + methods[m].name + ")";
    turning += between + rod_p95(m, &DirectionErrors::all_deg) + "° (" + methods[m].name + ")";
  }
  context.report.say(
      "While the rod slides, 95 % of the errors are below " + sliding +
      ". Where a stroke turns, friction changes its side while the encoders rest; with turns and "
      "pressing they are below " +
      turning + ".");
}

void show_displacements(StudyContext& context, const Data& data, double seconds) {
  const std::vector<DisplacementMethod>& methods = displacement_methods();
  report::WorkPrecision stage;
  stage.stage = "displacement";
  stage.logarithmic_error = false;
  stage.error_name = "displacement error, median";
  stage.remark =
      strokes_remark(data) +
      "|estimate - truth| / truth while pressing and stroking, where the truth exceeds 0.2 mm; mean "
      "of the objects' medians. Errors of whole pipelines, of which all but the last differ in this "
      "stage only; run time of the stage alone, on the same normals and forces. The recursive one "
      "needs no model.";
  stage.justification = "it is kept for objects that are pressed for long, where what needs no law drifts.";
  std::vector<std::string> headers{"method"};
  for (const std::string& object : data.objects) headers.push_back(object + " %");
  headers.emplace_back("p95 %");
  report::MarkdownTable table(headers);
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const auto of = [m](double share) {
      return [m, share](const Judged& j) { return quantile(j.displacement[m], share); };
    };
    stage.methods.push_back(
        {methods[m].name,
         over_objects(data, of(0.5)),
         displacement_run_time_ns(methods[m], identified(data.timed.object), data.timed.log, seconds),
         methods[m].is_default,
         {}});
    std::vector<std::string> row{methods[m].name + (methods[m].is_default ? " (default)" : "")};
    for (const std::string& object : data.objects) {
      row.push_back(fixed(100.0 * of(0.5)(data.judged.at(object)), 1));
    }
    row.push_back(fixed(100.0 * over_objects(data, of(0.95)), 1));
    table.add_row(row);
  }
  add_stage(context.report, stage);
  context.report.add_table("displacement_objects", "Displacement error by object", table,
                           "Medians; over all objects the 95th percentile.");
}

}  // namespace

void run_stroke_precision(StudyContext& context) {
  const double seconds = context.quick ? 0.01 : 0.2;
  const std::vector<DirectionMethod> directions = direction_methods();
  const Data data = judge_all(directions, context.quick);
  show_directions(context, directions, data, seconds);
  show_displacements(context, data, seconds);
}

}  // namespace hapticd::study
