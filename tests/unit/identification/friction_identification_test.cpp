#include "server/identification/session/friction_identification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "identified.h"
#include "rt/friction/dahl.h"
#include "rt/friction/maxwell_slip.h"
#include "server/identification/gate/stroke_effort.h"

namespace hapticd::identification {
namespace {

using namespace test;

/// A recording of strokes back and forth, sample by sample.
struct Strokes {
  rt::FrictionParameters truth{0.5, 0.2, 0.0};
  double amplitude_mm = 20.0;
  double hz = 0.5;
  double rate_hz = 200.0;
  double seconds = 20.0;
  double normal_n = 4.0;
  bool normal_recorded = true;
  double bias_n = 0.0;
  double position_noise_mm = 0.0;
  double force_noise_n = 0.0;
  double force_scale = 1.0, position_scale = 1.0;
  unsigned seed = 3;
};

using Spoil = std::function<void(std::int64_t tick, rt::Observation&)>;

void play(FrictionIdentification& identification, const Strokes& s, const Spoil& spoil = {}) {
  std::mt19937_64 random(s.seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  double z = 0.0;
  double last_mm = 0.0;
  rt::MaxwellSlip elements(s.truth.maxwell_slip.value_or(rt::MaxwellSlipParameters{}));
  const auto samples = static_cast<std::int64_t>(s.seconds * s.rate_hz);
  constexpr int kFine = 10;
  for (std::int64_t tick = 0; tick < samples; ++tick) {
    double x = 0.0;
    for (int k = 0; k < kFine; ++k) {
      const double t = (static_cast<double>(tick) + static_cast<double>(k + 1) / kFine) / s.rate_hz;
      x = s.amplitude_mm * std::sin(2.0 * M_PI * s.hz * t);
      z = s.truth.maxwell_slip ? elements.step(x - last_mm) / s.truth.kinetic
                               : rt::dahl_step(z, x - last_mm, s.truth.presliding_mm, s.truth.exponent);
      last_mm = x;
    }
    const double t = static_cast<double>(tick + 1) / s.rate_hz;
    const double speed = s.amplitude_mm * 2.0 * M_PI * s.hz * std::cos(2.0 * M_PI * s.hz * t);
    const double friction = s.truth.kinetic * s.normal_n * z + s.truth.viscous_n_s_per_mm * speed + s.bias_n +
                            s.force_noise_n * noise(random);
    rt::Observation observation;
    observation.sample.tick = static_cast<std::uint64_t>(tick);
    observation.sample.time_ns = std::llround(1e9 * t);
    observation.sample.tip_position_mm.x = s.position_scale * (x + s.position_noise_mm * noise(random));
    observation.sample.sensor_force_n = {-s.force_scale * friction, 0.0,
                                         s.normal_recorded ? s.force_scale * s.normal_n : 0.0};
    observation.sample.force_count = 1;
    if (spoil) spoil(tick, observation);
    identification.add(observation);
  }
}

hal::Result<rt::IdentifiedModel> found(const Strokes& strokes, FrictionTask task = {},
                                       const Spoil& spoil = {}) {
  FrictionIdentification identification(task, recording_rig(strokes.rate_hz));
  play(identification, strokes, spoil);
  return identification.finish();
}

const rt::FrictionParameters& friction_of(const rt::IdentifiedModel& model) {
  return std::get<rt::FrictionModel>(model.content).friction;
}

TEST(FrictionIdentification, FindsLongStrokesByDivideAndConquer) {
  const auto model = value_of(found({.bias_n = 0.3, .force_noise_n = 0.02}));
  EXPECT_NEAR(friction_of(model).kinetic, 0.5, 0.005);
  EXPECT_NEAR(friction_of(model).presliding_mm, 0.2, 0.05);
  EXPECT_NEAR(parameter(model, "force_bias_n").value, 0.3, 0.01);
  EXPECT_NE(model.procedure.find("apart"), std::string::npos);
}

TEST(FrictionIdentification, AnExactFitIsNoReasonToDoubtOneDirection) {
  const auto model = value_of(found({.truth = {0.5, 0.0, 0.0}}));
  EXPECT_NEAR(friction_of(model).kinetic, 0.5, 1e-6);
  EXPECT_NEAR(parameter(model, "force_bias_n").value, 0.0, 1e-6);
}

TEST(FrictionIdentification, FindsShortStrokesThatNeverSlide) {
  for (const double exponent : {1.0, 0.2}) {
    Strokes strokes{.truth = {0.45, 0.06, 0.0, exponent}, .amplitude_mm = 0.12, .force_noise_n = 0.01};
    const auto model = value_of(found(strokes, {.exponent = true}));
    EXPECT_NEAR(friction_of(model).kinetic, 0.45, 0.01);
    EXPECT_NEAR(friction_of(model).presliding_mm, 0.06, 0.004);
    EXPECT_NEAR(friction_of(model).exponent, exponent, 0.1);
    EXPECT_NE(model.procedure.find("together"), std::string::npos);
    EXPECT_LT(model.residual, 0.03);
  }
}

TEST(FrictionIdentification, TakesAnotherExponentOnlyWhereHeldOutStrokesAskForIt) {
  for (const double exponent : {1.0, 0.1}) {
    Strokes strokes{.truth = {0.45, 0.06, 0.0, exponent}, .amplitude_mm = 0.12, .force_noise_n = 0.01};
    const auto model = value_of(found(strokes));
    EXPECT_LT(parameter(model, "held_out_dahl_exponent").value, 0.03);
    EXPECT_GT(parameter(model, "held_out_maxwell_slip").value, 0.0);
    if (exponent == 1.0) {
      EXPECT_EQ(friction_of(model).exponent, 1.0) << model.procedure;
    } else {
      EXPECT_NEAR(friction_of(model).exponent, exponent, 0.1);
      EXPECT_GT(parameter(model, "held_out_dahl").value,
                2.0 * parameter(model, "held_out_dahl_exponent").value);
      const auto as_published = found(strokes, {.exponent_is_one = true});
      ASSERT_TRUE(as_published);
      EXPECT_EQ(friction_of(*as_published).exponent, 1.0);
    }
  }
}

/// Encoders behind a structure of 2 N/mm whose motors hold with 0.2 N: they follow the tip with play.
hal::RigInfo held_encoders() {
  hal::RigInfo rig = recording_rig(Strokes{}.rate_hz);
  rig.device.coulomb_friction_n = 0.2;
  rig.device.structural_stiffness_n_per_mm = 2.0;
  return rig;
}
Spoil with_play(double play_mm) {
  return [play_mm, seen_mm = 0.0](std::int64_t, rt::Observation& o) mutable {
    double& x = o.sample.tip_position_mm.x;
    seen_mm = std::clamp(seen_mm, x - play_mm, x + play_mm);
    x = seen_mm;
  };
}

TEST(FrictionIdentification, CountsWhatTheTipSlidesUnseenAtEachTurn) {
  EXPECT_DOUBLE_EQ(unseen_turn_mm(held_encoders().device), 0.2);
  hal::RigInfo friction_not_known = held_encoders();
  friction_not_known.device.coulomb_friction_n = 0.0;
  EXPECT_EQ(unseen_turn_mm(friction_not_known.device), 0.0);
  hal::RigInfo stiffness_not_known = held_encoders();
  stiffness_not_known.device.structural_stiffness_n_per_mm = 0.0;
  EXPECT_EQ(unseen_turn_mm(stiffness_not_known.device), 0.0);
  for (const double presliding_mm : {0.1, 0.2, 0.5}) {
    Strokes strokes;
    strokes.truth.presliding_mm = presliding_mm;
    strokes.force_noise_n = 0.01;
    const auto presliding_of = [&](const hal::RigInfo& rig) {
      FrictionIdentification identification({.exponent_is_one = true}, rig);
      play(identification, strokes, with_play(0.1));
      const auto model = identification.finish();
      EXPECT_TRUE(model);
      return model ? friction_of(*model).presliding_mm : 0.0;
    };
    EXPECT_NEAR(presliding_of(held_encoders()), presliding_mm, 0.25 * presliding_mm);
    EXPECT_LT(presliding_of(friction_not_known), 0.75 * presliding_mm) << "else the test shows nothing";
  }
}

TEST(FrictionIdentification, FindsAnExponentAboveOneOnlyWhereThePositionIsTheTips) {
  for (const bool sees_tip : {false, true}) {
    for (const bool asked_for : {false, true}) {
      Strokes strokes;
      strokes.truth.exponent = 2.0;
      strokes.force_noise_n = 0.005;
      hal::RigInfo rig = recording_rig(strokes.rate_hz);
      rig.has_external_position = sees_tip;
      FrictionIdentification identification({.exponent = asked_for}, rig);
      play(identification, strokes);
      const auto model = value_of(identification.finish());
      EXPECT_EQ(has_remark(identification, "dry friction or structural stiffness is not known"), !sees_tip);
      const rt::FrictionParameters& friction = friction_of(model);
      if (!sees_tip) {
        EXPECT_LE(friction.exponent, 1.0) << model.procedure;
      } else if (asked_for) {
        EXPECT_NEAR(friction.exponent, 2.0, 0.3);
      }
    }
  }
}

/// One that sticks to 0.8 of its level and one that slips farther on: no Dahl law turns like that.
rt::FrictionParameters kinked() {
  const rt::MaxwellSlipParameters elements{{0.4, 3.0}, {1.0, 0.033}};
  return {elements.kinetic(), elements.presliding_mm(), 0.0, 1.0, elements};
}

TEST(FrictionIdentification, TakesMaxwellSlipElementsWhereHeldOutStrokesAskForThem) {
  Strokes strokes{.truth = kinked(), .force_noise_n = 0.01};
  const auto model = value_of(found(strokes));
  const rt::FrictionParameters& friction = friction_of(model);
  ASSERT_TRUE(friction.maxwell_slip) << model.procedure;
  EXPECT_NE(model.procedure.find("held-out strokes ask for them"), std::string::npos) << model.procedure;
  EXPECT_NEAR(friction.kinetic, strokes.truth.kinetic, 0.01);
  EXPECT_GE(parameter(model, "maxwell_slip_elements").value, 2.0);
  EXPECT_LT(parameter(model, "held_out_maxwell_slip").value,
            parameter(model, "held_out_dahl_exponent").value);
  // What is found predicts the true one, not the recording alone.
  rt::MaxwellSlip truth(*strokes.truth.maxwell_slip);
  rt::MaxwellSlip by_model(*friction.maxwell_slip);
  double worst = 0.0;
  double last_mm = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const double x = 8.0 * std::sin(0.01 * i);
    worst = std::max(worst, std::abs(truth.step(x - last_mm) - by_model.step(x - last_mm)));
    last_mm = x;
  }
  EXPECT_LT(worst, 0.1 * strokes.truth.kinetic);
  EXPECT_FALSE(rt::check(model));
}

TEST(FrictionIdentification, TakesTheLawItsTaskNames) {
  Strokes strokes{.truth = kinked()};
  for (const bool exponent : {false, true}) {
    FrictionTask task{.exponent = exponent, .exponent_is_one = !exponent};
    const auto model = value_of(found(strokes, task));
    EXPECT_FALSE(friction_of(model).maxwell_slip);
    EXPECT_EQ(model.procedure.rfind("Dahl's law", 0), 0U) << model.procedure;
  }
}

TEST(FrictionIdentification, SaysHowSureItIs) {
  // Errors that last as long as a passage: the level itself differs from stroke to stroke.
  double squared = 0.0;
  double normed = 0.0;
  constexpr int kRounds = 12;
  for (unsigned seed = 0; seed < kRounds; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> level(1.0, 0.05);
    double now = 1.0;
    int half = -1;
    const auto model = found({.seed = seed}, {}, [&](std::int64_t tick, rt::Observation& o) {
      const int passage = static_cast<int>(std::floor(static_cast<double>(tick) / 200.0 + 0.5));
      if (passage != half) now = level(random);
      half = passage;
      o.sample.sensor_force_n.x *= now;
    });
    ASSERT_TRUE(model);
    const rt::EstimatedParameter& p = parameter(*model, "kinetic");
    squared += (p.value - 0.5) * (p.value - 0.5);
    normed += (p.value - 0.5) * (p.value - 0.5) / (p.standard_error * p.standard_error);
  }
  EXPECT_GT(std::sqrt(squared / kRounds), 1e-3) << "else the test shows nothing";
  EXPECT_LT(std::sqrt(normed / kRounds), 2.0);
  EXPECT_GT(std::sqrt(normed / kRounds), 0.4);
}

TEST(FrictionIdentification, TellsFrictionInNewtonWithoutANormalForce) {
  Strokes strokes{.normal_recorded = false};
  strokes.bias_n = 50.0;  // as pressure on a piston
  strokes.position_noise_mm = 0.02;
  strokes.rate_hz = 100.0;
  const auto model = value_of(found(strokes));
  EXPECT_NEAR(parameter(model, "coulomb_force_n").value, 2.0, 0.05);
  const auto reported = value_of(found(strokes, {.normal_force_n = 4.0}));
  EXPECT_NEAR(friction_of(reported).kinetic, 0.5, 0.01);
}

TEST(FrictionIdentification, StandsGapsOutliersAndSaturation) {
  Strokes strokes;
  const auto spoilt = found(strokes, {}, [](std::int64_t tick, rt::Observation& o) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    if (tick % 97 == 0) o.sample.tip_position_mm.x += 0.5;  // single outliers
    if (tick % 211 == 0) o.sample.sensor_force_n.x = kNaN;
    if (tick % 307 == 0) o.sample.tip_position_mm.z = kNaN;
    if (tick % 401 == 0) o.sample.status = hal::sample_status::kForceSaturated;
    if (tick > 1000) o.sample.time_ns += 800'000'000;  // a gap
  });
  ASSERT_TRUE(spoilt) << spoilt.error().text();
  EXPECT_NEAR(friction_of(*spoilt).kinetic, 0.5, 0.01);
  EXPECT_NEAR(friction_of(*spoilt).presliding_mm, 0.2, 0.06);
  for (const char* word : {"not a number", "range", "1 gap"}) {
    EXPECT_NE(spoilt->procedure.find(word), std::string::npos) << spoilt->procedure;
  }
  // A clipped force is what it is; the remark says what that may mean.
  const auto clipped = found(strokes, {}, [](std::int64_t, rt::Observation& o) {
    o.sample.sensor_force_n.x = std::clamp(o.sample.sensor_force_n.x, -1.5, 10.0);
  });
  ASSERT_TRUE(clipped) << clipped.error().text();
  EXPECT_NE(clipped->procedure.find("exactly the largest force"), std::string::npos);
}

TEST(FrictionIdentification, RefusesWhatSaysNothing) {
  const auto refused = [](const Strokes& strokes, const Spoil& spoil, const char* word,
                          double seconds = 20.0) {
    Strokes s = strokes;
    s.seconds = seconds;
    const auto model = found(s, {}, spoil);
    ASSERT_FALSE(model) << word;
    EXPECT_NE(model.error().text().find(word), std::string::npos) << model.error().text();
    EXPECT_FALSE(model.error().remedy.empty());
  };
  refused({}, {}, "too little data", 0.05);
  refused(
      {}, [](std::int64_t, rt::Observation& o) { o.sample.tip_position_mm.x = 3.0; }, "did not move");
  refused(
      {}, [](std::int64_t, rt::Observation& o) { o.sample.sensor_force_n.x = 1.0; }, "does not vary");
  refused(
      {}, [](std::int64_t, rt::Observation& o) { o.sample.sensor_force_n.x *= -1.0; },
      "along with the motion");
  refused(
      {}, [](std::int64_t, rt::Observation& o) { o.sample.sensor_force_n = {}; }, "does not vary");
  refused(
      {}, [](std::int64_t, rt::Observation& o) { o.sample.sensor_force_n.x *= 1000.0; }, "unit");  // N as mN
  refused({.amplitude_mm = 4.0, .position_scale = 1e-3}, {}, "unit");
  refused(
      {}, [](std::int64_t tick, rt::Observation& o) { o.sample.time_ns = -tick; }, "too little data");
  refused(
      {},
      [](std::int64_t tick, rt::Observation& o) {
        o.sample.tip_position_mm.x = 0.01 * static_cast<double>(tick);
      },
      "back and forth");
}

TEST(FrictionIdentification, NeverEndingStrokesNeedNoMoreMemory) {
  StrokePassages passages(0.007);
  for (int i = 0; i < 1'000'000; ++i) {
    const double t = 1e-3 * i;
    passages.add({t, 20.0 * std::sin(2.0 * t), 0.0, 1.0, 3.0});
  }
  const std::vector<StrokePassage> kept = passages.all();
  EXPECT_LE(kept.size(), StrokePassages::kMax + 1);
  EXPECT_GT(passages.given_up(), 100U);
  for (const StrokePassage& passage : kept) EXPECT_LE(passage.rows.rows().size(), StrokeRows::kMax);
  // One passage that lasts for ever.
  StrokePassages resting(0.007);
  for (int i = 0; i < 1'000'000; ++i) resting.add({1e-3 * i, std::min(5.0, 0.01 * i), 0.0, 1.0, 3.0});
  ASSERT_EQ(resting.all().size(), 1U);
  EXPECT_LE(resting.all().front().rows.rows().size(), 2 * StrokeRows::kMax);
}

TEST(FrictionIdentification, WishesTapsThenStrokesAndNothingOfARecording) {
  FrictionIdentification live({}, hal::RigInfo{});
  EXPECT_EQ(live.next_request().motion, MotionRequest::Motion::kLightTaps);
  const IdentificationProgress progress = live.progress();
  EXPECT_FALSE(progress.converged);
  EXPECT_FALSE(progress.missing.empty());
  EXPECT_TRUE(std::isnan(progress.residual));
  EXPECT_EQ(progress.completion, 0.0);
  ASSERT_FALSE(live.finish());

  Strokes strokes;
  FrictionIdentification recorded({}, recording_rig(strokes.rate_hz));
  EXPECT_EQ(recorded.next_request().motion, MotionRequest::Motion::kRest);
  play(recorded, strokes);
  EXPECT_TRUE(recorded.progress().converged);
  for (const std::string& word : recorded.progress().missing) ADD_FAILURE() << word;
  EXPECT_EQ(recorded.progress().completion, 1.0);
  EXPECT_LE(recorded.progress().fit.size(), 200U);
}

/// A contact of so many seconds, of which so many slide.
void contact_of(StrokeEffort& effort, double force_n, double seconds, double sliding_s) {
  for (int i = 0; i < static_cast<int>(1e3 * seconds); ++i)
    effort.touch(1e-3 * i, force_n, i < 1e3 * sliding_s);
  effort.release();
}

TEST(StrokeEffort, AsksForLessWhereTheTipSticks) {
  StrokeEffort effort;
  contact_of(effort, 8.0, 4.0, 2.0);
  contact_of(effort, 8.0, 0.3, 0.0);
  EXPECT_DOUBLE_EQ(effort.asked_n(5.0, 1.2), 5.0) << "it slid, or only tapped";
  contact_of(effort, 8.0, 4.0, 0.1);
  EXPECT_DOUBLE_EQ(effort.asked_n(5.0, 1.2), 4.0);
  EXPECT_DOUBLE_EQ(effort.asked_n(3.0, 1.2), 3.0);
  contact_of(effort, 2.0, 4.0, 0.0);
  EXPECT_DOUBLE_EQ(effort.asked_n(5.0, 1.2), 1.2);
}

TEST(StrokeEffort, AsksForLessWhereTheSensorSaturates) {
  StrokeEffort effort;
  effort.touch(0.0, 6.0, true);
  for (int i = 1; i < 30; ++i) effort.saturate(1e-3 * i);
  effort.release();
  EXPECT_DOUBLE_EQ(effort.asked_n(5.0, 1.2), 5.0) << "a spike";
  effort.touch(0.0, 6.0, true);
  for (int i = 1; i < 100; ++i) effort.saturate(1e-3 * i);
  effort.release();
  EXPECT_DOUBLE_EQ(effort.asked_n(5.0, 1.2), 3.0);
}

TEST(MaxwellSlip, ClosesItsLoopsAndHoldsItsLevel) {
  rt::MaxwellSlipParameters p{.reach_mm = {0.05, 0.1}, .stiffness_per_mm = {5.0, 2.0}};
  rt::MaxwellSlip law(p);
  EXPECT_NEAR(law.step(10.0), p.kinetic(), 1e-12);
  const double before = law.step(-0.03);
  law.step(0.01);
  EXPECT_NEAR(law.step(-0.01), before, 1e-12) << "an inner loop closes";
  EXPECT_NEAR(law.step(-1e9), -p.kinetic(), 1e-9);
  for (int i = 0; i < 1000; ++i) law.step(0.0);
  EXPECT_NEAR(law.step(0.0), -p.kinetic(), 1e-9) << "rest changes nothing";
  for (int i = 0; i < 36'000'000; ++i) law.step(0.0);
  EXPECT_NEAR(law.step(0.0), -p.kinetic(), 1e-9) << "nor do ten hours of it";
  EXPECT_NEAR(law.step(std::numeric_limits<double>::quiet_NaN()), -p.kinetic(), 1e-9);
  EXPECT_NEAR(law.step(std::numeric_limits<double>::infinity()), p.kinetic(), 1e-9);
  law.release();
  EXPECT_EQ(law.step(0.0), 0.0);
}

/// Strokes of a law under 5 N.
std::vector<FrictionRow> rows_of(const rt::MaxwellSlipParameters& truth, double amplitude_mm, double bias_n,
                                 double viscous_n_s_per_mm) {
  rt::MaxwellSlip law(truth);
  std::vector<FrictionRow> rows;
  double last_mm = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const double x = amplitude_mm * std::sin(0.02 * i);
    FrictionRow row;
    if (i == 0) row.before = FrictionRow::State::kNothing;
    row.slide_mm = x - last_mm;
    last_mm = x;
    row.path_mm = 2.0 * amplitude_mm;
    row.normal_n = 5.0;
    row.speed_mm_per_s = 1000.0 * row.slide_mm;
    row.friction_n = 5.0 * law.step(row.slide_mm) + bias_n + viscous_n_s_per_mm * row.speed_mm_per_s;
    row.passage = i / 157;
    row.settled = row.passage >= 2;
    rows.push_back(row);
  }
  return rows;
}

TEST(MaxwellSlip, IsFoundFromItsLoops) {
  rt::MaxwellSlipParameters truth{.reach_mm = {0.03, 0.08}, .stiffness_per_mm = {6.0, 3.0}};
  const auto fit = value_of(fit_maxwell_slip(rows_of(truth, 0.12, 0.2, 0.0), {.bias = true}));
  EXPECT_LT(fit.residual, 0.01);
  EXPECT_NEAR(fit.parameters.kinetic(), truth.kinetic(), 0.02);
  EXPECT_NEAR(fit.bias_n, 0.2, 0.02);
  EXPECT_FALSE(fit_maxwell_slip({}, {.bias = true}));
}

TEST(MaxwellSlip, AFitHasAViscousPartWhereItIsAskedFor) {
  rt::MaxwellSlipParameters truth{.reach_mm = {0.1}, .stiffness_per_mm = {4.0}};
  constexpr double kViscous = 2e-3;
  const std::vector<FrictionRow> rows = rows_of(truth, 10.0, 0.0, kViscous);
  const auto with = value_of(fit_maxwell_slip(rows, {.viscous = true}));
  const auto without = value_of(fit_maxwell_slip(rows, {}));
  EXPECT_NEAR(with.viscous_n_s_per_mm, kViscous, 0.05 * kViscous);
  EXPECT_EQ(without.viscous_n_s_per_mm, 0.0);
  EXPECT_LT(with.residual, 0.3 * without.residual);
  EXPECT_NEAR(with.friction().kinetic, truth.kinetic(), 0.02);
}

}  // namespace
}  // namespace hapticd::identification
