#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "rt/friction/dahl.h"
#include "rt/friction/maxwell_slip.h"
#include "server/identification/estimate/friction/friction_law_fit.h"
#include "server/identification/estimate/friction/maxwell_slip_fit.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/identify/friction_validation.h"
#include "tests/measure/study/precision/estimation_stages.h"
#include "tests/measure/study/precision/published_dahl.h"
#include "tests/measure/report/run_time.h"
#include "tests/measure/report/work_precision.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using test::value_of;

using report::fixed;
using Strokes = std::vector<FrictionInstant>;

constexpr double kIdentifiedOnMm = 35.0;
constexpr double kJudgedOnMm = 50.0;
constexpr double kMovesMmPerS = 2.0;

/// Whether another stroke began: nothing is built up then.
bool begins(const FrictionInstant& now, double last_s) {
  return now.time_s - last_s > 0.01;
}

/// What laws are fitted to: each instant, resolved along the true normal as D§4.4.1 does it.
std::vector<identification::FrictionRow> rows_of(const Strokes& strokes) {
  constexpr double kTurnMm = 0.05;
  constexpr double kSlidingPathMm = 3.0;
  std::vector<identification::FrictionRow> rows;
  double last_s = -1.0;
  double path_mm = 0.0, farthest_mm = 0.0;
  int heading = 0;
  int passage = 0;
  bool known = false;
  for (const FrictionInstant& s : strokes) {
    identification::FrictionRow row;
    const bool first = begins(s, last_s);
    last_s = s.time_s;
    if (first) {
      row.before = identification::FrictionRow::State::kNothing;
      heading = 0;
      path_mm = 0.0;
      farthest_mm = s.along_mm;
      known = false;
      ++passage;
    } else {
      row.slide_mm = s.slide_mm;
    }
    const double ahead_mm = (s.along_mm - farthest_mm) * (heading == 0 ? 1 : heading);
    if (heading == 0 ? std::abs(ahead_mm) > kTurnMm : ahead_mm < -kTurnMm) {
      known = known || path_mm >= kSlidingPathMm;
      heading = s.along_mm > farthest_mm ? 1 : -1;
      farthest_mm = s.along_mm;
      path_mm = 0.0;
      ++passage;
    } else if (ahead_mm > 0.0 && heading != 0) {
      path_mm += ahead_mm;
      farthest_mm = s.along_mm;
    }
    row.path_mm = path_mm;
    row.speed_mm_per_s = s.speed_mm_per_s;
    row.normal_n = s.normal_n;
    row.friction_n = s.measured_friction_n;
    row.along_mm = s.along_mm;
    row.passage = passage;
    row.heading = heading;
    row.settled = known || path_mm >= kSlidingPathMm;
    rows.push_back(row);
  }
  return rows;
}

/// All that was identified on one object with the rod.
struct Fitted {
  rt::FrictionParameters coulomb, dahl, bent;
  rt::MaxwellSlipParameters slip;
  double mean_normal_n = 0.0;
  /// σ of the laws that know no load: right at the mean one.
  double stiffness_n_per_mm() const { return dahl.kinetic * mean_normal_n / dahl.presliding_mm; }
};

/// The Maxwell-slip fit takes all rows that are settled; the others are reported what is too slow for
/// encoders.
std::vector<identification::FrictionRow> moving(std::vector<identification::FrictionRow> rows) {
  for (identification::FrictionRow& row : rows) {
    row.settled = row.settled && std::abs(row.speed_mm_per_s) >= kMovesMmPerS;
  }
  return rows;
}

Fitted fitted_to(const Strokes& strokes) {
  const std::vector<identification::FrictionRow> rows = rows_of(strokes);
  identification::FrictionFitOptions options;
  options.min_speed_mm_per_s = kMovesMmPerS;
  options.presliding_mm_per_s = 40.0;  // as identification::FrictionIdentification has them
  options.sliding_mm_per_s = 10.0;
  Fitted fitted;
  fitted.dahl = value_of(identification::fit_friction_law(rows, options)).parameters;
  options.exponent = true;
  fitted.bent = value_of(identification::fit_friction_law(rows, options)).parameters;
  options.exponent = false;
  options.law = rt::FrictionLaw::kCoulombViscous;
  fitted.coulomb = value_of(identification::fit_friction_law(rows, options)).parameters;
  fitted.slip = value_of(identification::fit_maxwell_slip(moving(rows), {})).parameters;
  for (const FrictionInstant& s : strokes) {
    fitted.mean_normal_n += s.normal_n / static_cast<double>(strokes.size());
  }
  return fitted;
}

/// The laws, one step each; friction against motion along the line.
struct CoulombStep {
  rt::FrictionParameters p;
  double sign = 0.0;
  double operator()(const FrictionInstant& s) noexcept {
    if (s.slide_mm != 0.0) sign = std::copysign(1.0, s.slide_mm);
    return p.kinetic * s.normal_n * sign + p.viscous_n_s_per_mm * s.speed_mm_per_s;
  }
};
struct DahlStep {
  rt::FrictionParameters p;
  double z = 0.0;
  double operator()(const FrictionInstant& s) noexcept {
    z = rt::dahl_step(z, s.slide_mm, p.presliding_mm, p.exponent);
    return p.kinetic * s.normal_n * z + p.viscous_n_s_per_mm * s.speed_mm_per_s;
  }
};
struct PublishedDahlStep {
  rt::FrictionParameters p;
  PublishedDahl law;
  double operator()(const FrictionInstant& s) noexcept {
    return law.step(s.slide_mm, s.speed_mm_per_s, p.kinetic * s.normal_n) +
           p.viscous_n_s_per_mm * s.speed_mm_per_s;
  }
};
struct EulerDahlStep {
  rt::FrictionParameters p;
  EulerDahl law;
  double operator()(const FrictionInstant& s) noexcept {
    return law.step(s.slide_mm, p.kinetic * s.normal_n) + p.viscous_n_s_per_mm * s.speed_mm_per_s;
  }
};
struct SlipStep {
  rt::MaxwellSlip law;
  double operator()(const FrictionInstant& s) noexcept { return law.step(s.slide_mm) * s.normal_n; }
};

/// Mean |predicted - true| over mean |true| while the tip moves, turns included.
struct FrictionError {
  double left = 0.0, whole = 0.0;
  double value() const { return left / whole; }
  /// Ten times what is to be predicted is not a prediction.
  bool diverges() const { return !(value() < 10.0); }
};

struct Law {
  std::string name;
  bool is_default = false;
  std::vector<FrictionError> of_object{};
  double run_time_ns = 0.0;

  double error() const {
    double sum = 0.0;
    for (const FrictionError& e : of_object) sum += e.value();
    return sum / static_cast<double>(of_object.size());
  }
};

struct Object {
  std::string name;
  Fitted fitted;
  Strokes strokes;
};

/// `make(Fitted)` gives a law at rest.
template <class Make>
Law measured(const std::string& name, Make make, const std::vector<Object>& objects, double seconds,
             bool is_default = false) {
  Law law{name, is_default};
  std::size_t ticks = 0;
  const auto run = [&](const Object& object, auto&& each) {
    auto step = make(object.fitted);
    double last_s = -1.0;
    for (const FrictionInstant& s : object.strokes) {
      if (begins(s, last_s)) step = make(object.fitted);
      last_s = s.time_s;
      each(s, step(s));
    }
  };
  for (const Object& object : objects) {
    FrictionError error;
    run(object, [&](const FrictionInstant& s, double predicted_n) {
      if (std::abs(s.speed_mm_per_s) < kMovesMmPerS) return;
      error.left += std::abs(predicted_n - s.true_friction_n);
      error.whole += std::abs(s.true_friction_n);
    });
    law.of_object.push_back(error);
    ticks += object.strokes.size();
  }
  law.run_time_ns = report::run_time_ns(
      ticks,
      [&] {
        double sum = 0.0;
        for (const Object& object : objects) {
          run(object, [&](const FrictionInstant&, double predicted_n) { sum += predicted_n; });
        }
        return sum;
      },
      seconds);
  return law;
}

/// The longest step of the strokes against what the law's own length is at that load.
double longest_step(const Object& object) {
  double most = 0.0;
  for (const FrictionInstant& s : object.strokes) {
    const double coulomb_n = object.fitted.dahl.kinetic * s.normal_n;
    if (coulomb_n > 0.0) {
      most = std::max(most, object.fitted.stiffness_n_per_mm() * std::abs(s.slide_mm) / coulomb_n);
    }
  }
  return most;
}

}  // namespace

void run_friction_precision(StudyContext& context) {
  std::vector<Object> objects;
  for (const std::string& name : explored_objects()) {
    if (context.quick && objects.size() == 2) break;
    objects.push_back({name, fitted_to(validation_strokes(name, "rod", kIdentifiedOnMm)),
                       validation_strokes(name, "rod", kJudgedOnMm)});
  }
  const double seconds = context.quick ? 0.01 : 0.2;
  const std::vector<Law> laws{
      measured(
          "Dahl, exact step", [](const Fitted& f) { return DahlStep{f.dahl}; }, objects, seconds, true),
      measured(
          "Dahl, exact step, exponent found", [](const Fitted& f) { return DahlStep{f.bent}; }, objects,
          seconds),
      measured(
          "Coulomb-viscous (4.11)", [](const Fitted& f) { return CoulombStep{f.coulomb}; }, objects, seconds),
      measured(
          "Dahl as published (4.14)",
          [](const Fitted& f) {
            return PublishedDahlStep{f.dahl, PublishedDahl(f.stiffness_n_per_mm())};
          },
          objects, seconds),
      measured(
          "Dahl (4.12), explicit Euler",
          [](const Fitted& f) {
            return EulerDahlStep{f.dahl, EulerDahl(f.stiffness_n_per_mm())};
          },
          objects, seconds),
      measured(
          "Maxwell-slip, up to 8 elements", [](const Fitted& f) { return SlipStep{rt::MaxwellSlip(f.slip)}; },
          objects, seconds)};

  report::WorkPrecision stage;
  stage.stage = "friction";
  stage.error_name = "friction error over mean friction";
  stage.remark =
      "Strokes of a rod back and forth over " + fixed(kJudgedOnMm, 0) +
      " mm on the objects of D§4 at 2-4 N and up to 120 mm/s (seed 97), high-force device; each law fitted "
      "to "
      "strokes over " +
      fixed(kIdentifiedOnMm, 0) +
      " mm. All laws get the encoders' slide and the sensor's normal force, resolved along the true normal, "
      "and are judged by the simulator's own friction (elasto-plastic LuGre with texture): mean |predicted - "
      "true| over mean |true| while the tip moves faster than 2 mm/s, turns included; mean over the objects. "
      "Run time of the law alone. The Maxwell-slip law has no viscous part.";
  stage.logarithmic_error = false;
  stage.justification =
      "among laws this close it is the one that knows the load, has one parameter of presliding, and is "
      "exact "
      "for steps of any length.";
  std::vector<std::string> headers{"law"};
  for (const Object& object : objects) headers.push_back(object.name + " %");
  report::MarkdownTable table(headers);
  for (const Law& law : laws) {
    stage.methods.push_back({law.name, law.error(), law.run_time_ns, law.is_default, {}});
    std::vector<std::string> row{law.name + (law.is_default ? " (default)" : "")};
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const FrictionError& error = law.of_object[i];
      row.push_back(error.diverges() ? "diverges" : fixed(100.0 * error.value(), 1));
      if (!error.diverges() || !stage.methods.back().failed.empty()) continue;
      stage.methods.back().failed = "diverges on " + objects[i].name + ", where σ|Δx|/f_c reaches " +
                                    report::significant(longest_step(objects[i]), 2) +
                                    "; explicit steps need less than 2";
    }
    table.add_row(row);
  }
  add_stage(context.report, stage);
  context.report.add_table("friction_objects", "Friction error by object", table);
}

}  // namespace hapticd::study
